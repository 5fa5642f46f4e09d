"""What a diagnosis of flights looks at: records, axes, and the forces that a model predicts."""
