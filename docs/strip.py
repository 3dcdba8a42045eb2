"""The picture at the top of the README: python docs/strip.py FIELDS.vtu PICTURE.png (pyvista, matplotlib, scipy)."""

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import pyvista
from scipy.spatial import cKDTree

fields, picture = sys.argv[1:3]
linear = pyvista.read(fields).tessellate(max_n_subdivide=1)
points, cells = linear.points[:, :2], linear.cells.reshape(-1, 4)[:, 1:]
x, y = (grid.ravel() for grid in np.meshgrid(np.arange(-5.75, 12, 0.5), np.arange(-4.75, 5, 0.5)))
outside = np.hypot(x, y) > 1.05
x, y = x[outside], y[outside]
nearest = cKDTree(points).query(np.c_[x, y])[1]

figure, axes = plt.subplots(2, 1, figsize=(11, 9.2))
for axis, name in zip(axes, ["velocity", "polarity"]):
    vector = linear.point_data[name]
    size = np.linalg.norm(vector, axis=1)
    colours = axis.tripcolor(points[:, 0], points[:, 1], cells, size, shading="gouraud", cmap="viridis")
    figure.colorbar(colours, ax=axis, pad=0.01, label=f"|{name[0]}|")
    axis.quiver(x, y, vector[nearest, 0], vector[nearest, 1], color="w", scale=42, width=0.0014)
    axis.set(aspect="equal", xlim=(-6, 12), ylim=(-5, 5), ylabel="$x_2$")
axes[0].set_title("velocity and polarity around a disc: β = 0.75, Pe = 2, κ = 0.1, B = 0.4, a = 1", fontsize=11)
axes[1].set_xlabel("$x_1$ (disc radii)")
figure.tight_layout()
figure.savefig(picture, dpi=85)
