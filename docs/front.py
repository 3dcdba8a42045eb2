"""A spreading front: python docs/front.py RUN_FOLDER PICTURE.png TIME… (pyvista, matplotlib)."""

import sys
import xml.etree.ElementTree as ElementTree

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import pyvista

folder, picture, *times = sys.argv[1:]
series = [
    (float(step.get("timestep")), step.get("file"))
    for step in ElementTree.parse(f"{folder}/fields.pvd").getroot().iter("DataSet")
]
figure, axes = plt.subplots(len(times), 1, figsize=(9, 2.9 * len(times)), sharex=True)
for axis, wanted in zip(np.atleast_1d(axes), times):
    t, file = min(series, key=lambda entry: abs(entry[0] - float(wanted)))
    linear = pyvista.read(f"{folder}/{file}").tessellate(max_n_subdivide=1)
    x, y = linear.points[:, 0], linear.points[:, 1]
    triangles = linear.cells.reshape(-1, 4)[:, 1:]
    density, polarity = linear.point_data["density"], linear.point_data["polarity"]
    colours = axis.tripcolor(x, y, triangles, density, shading="gouraud", cmap="viridis", vmin=0, vmax=1.6)
    figure.colorbar(colours, ax=axis, pad=0.01, label="ρ")
    some = np.random.default_rng(1).permutation(len(x))[:: max(1, len(x) // 500)]
    some = some[density[some] > 0.1]
    axis.quiver(x[some], y[some], polarity[some, 0], polarity[some, 1], color="w", scale=45, width=0.0015)
    axis.set(aspect="equal", ylabel="$x_2$", title=f"t = {t:g}")
np.atleast_1d(axes)[-1].set_xlabel("$x_1$ (disc radii)")
figure.tight_layout()
figure.savefig(picture, dpi=80)
