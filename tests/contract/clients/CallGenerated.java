import java.util.List;
import org.openapitools.client.*;
import org.openapitools.client.api.*;
import org.openapitools.client.model.*;

/** Calls the client that openapi-generator made for Java, over HttpClient with its defaults. */
class CallGenerated {
    public static void main(String[] words) throws ApiException {
        ApiClient client = new ApiClient();
        client.updateBaseUri(words[0]);
        Solid sphere = new Solid(sphere(1.125));
        ApiResponse<StoredSolidSummary> stored = new SolidsApi(client).putSolidWithHttpInfo(sphere);
        System.out.println(stored.getStatusCode());
        Solid solid = new Solid(new StoredSolid().type(StoredSolid.TypeEnum.STORED).id(stored.getData().getId()));
        List<List<Double>> points = List.of(List.of(2., 0., 0.), List.of(1.125, 0., 0.), List.of(0., 0., 0.));
        ContainsRequest question = new ContainsRequest().solid(solid).points(points);
        System.out.println(new ContainmentApi(client).contains(question).getContained().toString().replace(" ", ""));
        Solid box = new Solid(
            new AabbSolid().type(AabbSolid.TypeEnum.AABB).min(List.of(1.125, -1., -1.)).max(List.of(3., 1., 1.)));
        CollideRequest pair = new CollideRequest().first(sphere).second(box);
        System.out.println(new CollisionApi(client).collide(pair).getCollisions().get(0).getRelation());
        try {
            new BoundsApi(client).bounds(new BoundsRequest().solid(new Solid(sphere(-1.))));
        } catch (ApiException refused) {
            System.out.println(refused.getCode());
        }
    }

    static SphereSolid sphere(double radius) {
        return new SphereSolid().type(SphereSolid.TypeEnum.SPHERE).center(List.of(0., 0., 0.)).radius(radius);
    }
}
