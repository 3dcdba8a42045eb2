"""Puts what the studies in studies/tradeoff have found into docs/tradeoff.md and into the table of `check`.

From the repository: python docs/tradeoff.py out (a folder with the results mms, disc and strip)."""

import csv
import re
import shutil
import sys
from pathlib import Path

CASES = {
    "mms": ("manufactured square", {"velocity": "v in L2(L2)", "polarity": "p in L2(L2)"}),
    "disc": ("closed disc", {"free_energy": "free energy", "budget_viscosity": "viscous power"}),
    "strip": (
        "steady strip",
        {
            "overshoot_velocity": "overshoot of v",
            "overshoot_polarity": "overshoot of p",
            "asymmetry_velocity": "asymmetry of v",
        },
    ),
}
PRESETS = ["draft", "standard", "fine"]
REFERENCE = "(error of the reference)"


def read(folder):
    with open(folder / "tradeoff.csv") as file:
        return {row["setting"]: row for row in csv.DictReader(file)}


def short(text):
    return re.sub(r"e([+-])0*(\d)", lambda m: ("e-" if m[1] == "-" else "e") + m[2], f"{float(text):.1e}")


def seconds(row):
    value = float(row["seconds"])
    return f"{value:.1f}" if value < 10 else f"{value:.0f}"


def error(row, column):
    return row[f"bound {column}"] + short(row[f"error {column}"])


def measured(found):
    lines, code = [], []
    of = lambda name, preset: found[name][f"preset accuracy={preset}"]
    for name, (case, measures) in CASES.items():
        for column, measure in measures.items():
            errors = [error(of(name, p), column) for p in PRESETS]
            times = [seconds(of(name, p)) for p in PRESETS]
            lines += [(k, f"| {p} | {case} | {measure} | {errors[k]} | {float(times[k]):g} |") for k, p in enumerate(PRESETS)]
            quoted = ", ".join(f'"{e}"' for e in errors)
            code.append(
                f'    Measured {{\n        case: "{case}",\n        measure: "{measure}",\n        errors: [{quoted}],\n'
                f"        seconds: [{', '.join(str(float(t)) for t in times)}],\n    }},\n"
            )
    head = "| preset | case | measure | error | seconds |\n| --- | --- | --- | --- | --- |\n"
    lines.sort(key=lambda line: line[0])
    return head + "".join(line + "\n" for _, line in lines), "".join(code)


def settings(name, rows):
    case, measures = CASES[name]
    rule = "| --- " * (4 + len(measures)) + "|\n"
    text = f"### {case.capitalize()}\n\n![Error over seconds](tradeoff-{name}.png)\n\n"
    text += "| setting | seconds | MiB | unknowns | " + " | ".join(measures.values()) + " |\n" + rule
    for setting, row in rows.items():
        if setting == REFERENCE:
            cells = ["error of the reference", "", "", ""] + [short(row[f"error {c}"]) for c in measures]
        elif row["reason"]:
            cells = [setting, "failed", "", ""] + [""] * len(measures)
        else:
            marks = [error(row, c) + (" *" if row[f"on_front {c}"] == "yes" else "") for c in measures]
            cells = [setting, seconds(row), f"{float(row['peak_memory_mib']):.0f}", row["unknowns"]] + marks
        text += "| " + " | ".join(cells) + " |\n"
    return text + "\n"


def replace(path, begin, end, text):
    old = path.read_text()
    path.write_text(old[: old.index(begin) + len(begin)] + text + old[old.index(end, old.index(begin) + len(begin)) :])


results = Path(sys.argv[1])
found = {name: read(results / name) for name in CASES}
table, code = measured(found)
page = Path("docs/tradeoff.md")
replace(page, "<!-- presets -->\n\n", "\n<!-- end -->", table)
replace(page, "<!-- settings -->\n\n", "<!-- end -->", "".join(settings(name, rows) for name, rows in found.items()))
replace(Path("src/scene/presets.rs"), "pub const MEASURED: &[Measured] = &[\n", "];", code)
for name, (_, measures) in CASES.items():
    shutil.copy(results / name / f"tradeoff-{next(iter(measures))}.png", f"docs/tradeoff-{name}.png")
