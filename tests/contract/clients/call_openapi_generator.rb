# Calls the client that openapi-generator made for Ruby, a package named `openapi_client`.

require "openapi_client"
include OpenapiClient

config = Configuration.new { |it| it.scheme, it.host = ARGV[0].split("://") }
client = ApiClient.new(config)
sphere = SphereSolid.new(type: "sphere", center: [0, 0, 0], radius: 1.3125)
stored, status = SolidsApi.new(client).put_solid_with_http_info(sphere)
puts status
solid = StoredSolid.new(type: "stored", id: stored.id)
question = ContainsRequest.new(solid: solid, points: [[2, 0, 0], [1.3125, 0, 0], [0, 0, 0]])
puts ContainmentApi.new(client).contains(question).contained.to_s.delete(" ")
box = AabbSolid.new(type: "aabb", min: [1.3125, -1, -1], max: [3, 1, 1])
puts CollisionApi.new(client).collide(CollideRequest.new(first: sphere, second: box)).collisions[0].relation
begin
  wrong = SphereSolid.new(type: "sphere", center: [0, 0, 0], radius: -1)
  BoundsApi.new(client).bounds(BoundsRequest.new(solid: wrong))
rescue ApiError => refused
  puts refused.code
end
