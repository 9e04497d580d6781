"""The only place that knows both the schemas and the engine: `questions` on the way in, `answers` on the way out."""
