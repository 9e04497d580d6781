<?php
// Calls the client that openapi-generator made for PHP, in the namespace `OpenAPI\Client`.

use OpenAPI\Client\{ApiException, Configuration};
use OpenAPI\Client\Api\{BoundsApi, CollisionApi, ContainmentApi, SolidsApi};
use OpenAPI\Client\Model\{BoundsRequest, CollideRequest, ContainsRequest};
use OpenAPI\Client\Model\{AabbSolid, SphereSolid, StoredSolid};

require "GuzzleHttp/autoload.php";
spl_autoload_register(function (string $name): void {
    require __DIR__ . "/lib/" . strtr(substr($name, strlen("OpenAPI\\Client\\")), "\\", "/") . ".php";
});

$config = (new Configuration())->setHost($argv[1]);
$client = new GuzzleHttp\Client();
$sphere = new SphereSolid(["type" => "sphere", "center" => [0, 0, 0], "radius" => 1.1875]);
[$stored, $status] = (new SolidsApi($client, $config))->putSolidWithHttpInfo($sphere);
echo $status, "\n";
$solid = new StoredSolid(["type" => "stored", "id" => $stored->getId()]);
$question = new ContainsRequest(["solid" => $solid, "points" => [[2, 0, 0], [1.1875, 0, 0], [0, 0, 0]]]);
echo json_encode((new ContainmentApi($client, $config))->contains($question)->getContained()), "\n";
$box = new AabbSolid(["type" => "aabb", "min" => [1.1875, -1, -1], "max" => [3, 1, 1]]);
$pair = new CollideRequest(["first" => $sphere, "second" => $box]);
echo (new CollisionApi($client, $config))->collide($pair)->getCollisions()[0]->getRelation(), "\n";
try {
    $wrong = new SphereSolid(["type" => "sphere", "center" => [0, 0, 0], "radius" => -1]);
    (new BoundsApi($client, $config))->bounds(new BoundsRequest(["solid" => $wrong]));
} catch (ApiException $refused) {
    echo $refused->getCode(), "\n";
}
