"""What a diagnosis of depth looks at: frames, axes, histograms, and simulations of them."""
