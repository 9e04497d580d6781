// Calls the client that openapi-generator made for Go, a package in the folder `generated`.
package main

import (
	"context"
	"encoding/json"
	"fmt"
	api "generated"
	"os"
)

func main() {
	configuration := api.NewConfiguration()
	configuration.Servers = api.ServerConfigurations{{URL: os.Args[1]}}
	client, background := api.NewAPIClient(configuration), context.Background()
	sphere := api.SphereSolidAsSolid(api.NewSphereSolid("sphere", []float64{0, 0, 0}, 1.875))

	stored, answer, err := client.SolidsAPI.PutSolid(background).Solid(sphere).Execute()
	check(err)
	fmt.Println(answer.StatusCode)
	solid := api.StoredSolidAsSolid(api.NewStoredSolid("stored", stored.Id))
	question := api.NewContainsRequest(solid, [][]float64{{2, 0, 0}, {1.875, 0, 0}, {0, 0, 0}})
	inside, _, err := client.ContainmentAPI.Contains(background).ContainsRequest(*question).Execute()
	check(err)
	contained, _ := json.Marshal(inside.Contained)
	fmt.Println(string(contained))
	box := api.AabbSolidAsSolid(api.NewAabbSolid("aabb", []float64{1.875, -1, -1}, []float64{3, 1, 1}))
	met, _, err := client.CollisionAPI.Collide(background).CollideRequest(*api.NewCollideRequest(sphere, box)).Execute()
	check(err)
	fmt.Println(met.Collisions[0].Relation)
	bad := api.SphereSolidAsSolid(api.NewSphereSolid("sphere", []float64{0, 0, 0}, -1))
	_, answer, _ = client.BoundsAPI.Bounds(background).BoundsRequest(*api.NewBoundsRequest(bad)).Execute()
	fmt.Println(answer.StatusCode)
}

func check(err error) {
	if err != nil {
		panic(err)
	}
}
