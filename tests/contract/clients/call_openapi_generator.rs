// Calls the client that openapi-generator made for Rust, a crate named `openapi`.

use openapi::apis::{bounds_api, collision_api, configuration::Configuration, containment_api, solids_api, Error};
use openapi::models::*;

#[tokio::main(flavor = "current_thread")]
async fn main() {
    let mut service = Configuration::new();
    service.base_path = std::env::args().nth(1).unwrap();
    let sphere = Solid::Sphere(Box::new(SphereSolid::new(vec![0.0, 0.0, 0.0], 1.4375)));
    let stored = solids_api::put_solid(&service, sphere.clone()).await.unwrap();
    let points = vec![vec![2.0, 0.0, 0.0], vec![1.4375, 0.0, 0.0], vec![0.0, 0.0, 0.0]];
    let solid = Solid::Stored(Box::new(StoredSolid::new(stored.id)));
    let answer = containment_api::contains(&service, ContainsRequest::new(solid, points)).await.unwrap();
    println!("{}", format!("{:?}", answer.contained).replace(' ', ""));
    let cube = Solid::Aabb(Box::new(AabbSolid::new(vec![1.4375, -1.0, -1.0], vec![3.0, 1.0, 1.0])));
    let answer = collision_api::collide(&service, CollideRequest::new(sphere, cube)).await.unwrap();
    println!("{}", format!("{:?}", answer.collisions[0].relation).to_lowercase());
    let wrong = Solid::Sphere(Box::new(SphereSolid::new(vec![0.0, 0.0, 0.0], -1.0)));
    if let Err(Error::ResponseError(refused)) = bounds_api::bounds(&service, BoundsRequest::new(wrong)).await {
        println!("{}", refused.status.as_u16());
    }
}
