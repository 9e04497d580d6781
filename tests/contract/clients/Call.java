import java.net.URI;
import java.net.http.HttpClient;
import java.net.http.HttpRequest;
import java.net.http.HttpResponse;

/** Stores a solid and asks about points, with everything in HttpClient left as it is (HTTP/2 offered on each request). */
public class Call {
    public static void main(String[] arguments) throws Exception {
        HttpClient client = HttpClient.newHttpClient();
        String solid = "{\"type\": \"sphere\", \"center\": [0, 0, 0], \"radius\": 1.25}";
        System.out.println(post(client, arguments[0] + "/v1/solids", solid).statusCode());
        String question = "{\"solid\": " + solid + ", \"points\": [[2, 0, 0], [1.25, 0, 0], [0, 0, 0]]}";
        HttpResponse<String> answer = post(client, arguments[0] + "/v1/contains", question);
        System.out.println(answer.statusCode());
        System.out.println(answer.body().replaceAll(".*\"contained\":(\\[[^\\]]*\\]).*", "$1"));
    }

    private static HttpResponse<String> post(HttpClient client, String url, String body) throws Exception {
        HttpRequest request = HttpRequest.newBuilder(URI.create(url))
                .header("Content-Type", "application/json")
                .POST(HttpRequest.BodyPublishers.ofString(body))
                .build();
        return client.send(request, HttpResponse.BodyHandlers.ofString());
    }
}
