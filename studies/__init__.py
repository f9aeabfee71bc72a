"""What was found with the package: the paper, the robustness survey of presets, learned ranges."""
