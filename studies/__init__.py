"""Studies made with the package: the paper, the robustness of its finding, learned ranges."""
