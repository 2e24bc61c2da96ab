# SPDX-License-Identifier: MIT
"""ParaView opens a whole run, by run.xdmf and by the series of views/: times, counts, arrays and values are those of the
frames. Skipped where python3-paraview is not installed; tools/setup paraview installs it."""
import importlib.util
import pathlib
import sys

if __name__ == "__main__" and sys.path[0] == str(pathlib.Path(__file__).resolve().parent):
    here = sys.path.pop(0)  # this file would stand for the package of its own name
    if importlib.util.find_spec("paraview") is None:
        print("python3-paraview is not installed: skipped")
        sys.exit(77)
    from paraview import servermanager, simple
    sys.path.insert(0, here)

import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy

import lab


def leaves(data):
    """The data sets below a composite one, or itself."""
    if not data.IsA("vtkCompositeDataSet"):
        return [data]
    found, walk = [], data.NewIterator()
    while not walk.IsDoneWithTraversal():
        found.append(walk.GetCurrentDataObject())
        walk.GoToNextItem()
    return found


def arrays(data):
    part = data.GetPointData()
    return {part.GetArrayName(k): vtk_to_numpy(part.GetArray(k)) for k in range(part.GetNumberOfArrays())}


def expected(folder):
    """By time: by group: its arrays."""
    found = {}
    for frame in lab.frames(folder):
        contents = lab.contents(frame)
        groups = found.setdefault(float(contents["@time"]), {})
        for name, value in contents.items():
            if "@" not in name and len(value):
                groups.setdefault(name.split("/")[0], {})[name.split("/")[1]] = value
    return {time: {name: group for name, group in groups.items() if "position" in group}
            for time, groups in found.items()}


def compare(data, group, what):
    """One data set against one group of a frame; returns how many arrays were compared."""
    n = len(group["position"])
    assert data.GetNumberOfPoints() == n, f"{what}: {data.GetNumberOfPoints()} points, not {n}"
    assert numpy.array_equal(vtk_to_numpy(data.GetPoints().GetData()), group["position"]), f"{what}: other places"
    found = arrays(data)
    missing = set(group) - {"position"} - set(found)
    assert not missing, f"{what}: no {sorted(missing)}"
    for name in set(group) - {"position"}:
        assert numpy.array_equal(found[name], group[name]), f"{what}: {name} differs"
    assert data.GetNumberOfCells() == n, f"{what}: {data.GetNumberOfCells()} cells for {n} points"
    return len(group)


def check_series(folder, frames):
    names = sorted({name for groups in frames.values() for name in groups})
    assert sorted(path.name for path in (folder / "views").glob("*.series")) == [f"{n}.hdf.series" for n in names]
    for name in names:
        reader = simple.OpenDataFile(str(folder / "views" / f"{name}.hdf.series"))
        reader.UpdatePipelineInformation()
        times = [time for time, groups in frames.items() if name in groups]
        assert list(reader.TimestepValues) == times, f"{name}: times {list(reader.TimestepValues)}, not {times}"
        count = 0
        for time in times:
            reader.UpdatePipeline(time)
            data, = leaves(servermanager.Fetch(reader))
            count += compare(data, frames[time][name], f"views/{name}.hdf.series at {time}")
        print(f"views/{name}.hdf.series: {len(times)} times, {count} arrays the same")
        simple.Delete(reader)


def check_xdmf(folder, frames, label, make):
    reader = make(str(folder / "run.xdmf"))
    reader.UpdatePipelineInformation()
    assert list(reader.TimestepValues) == list(frames), f"{label}: times {list(reader.TimestepValues)}"
    count = 0
    for time, groups in frames.items():
        reader.UpdatePipeline(time)
        found = [data for data in leaves(servermanager.Fetch(reader)) if data.GetNumberOfPoints()]
        assert len(found) == len(groups), f"{label} at {time}: {len(found)} sets, not {sorted(groups)}"
        left = dict(groups)
        for data in found:  # a reader may give them in an order of its own
            name = next((n for n in left if len(left[n]["position"]) == data.GetNumberOfPoints()
                         and set(left[n]) - {"position"} <= set(arrays(data))), None)
            assert name, f"{label} at {time}: {data.GetNumberOfPoints()} points fit no group"
            count += compare(data, left.pop(name), f"run.xdmf by {label} at {time}: {name}")
    print(f"run.xdmf by {label}: {len(frames)} times, {count} arrays the same")
    simple.Delete(reader)


def check(name, folder):
    fields = "[grain.velocity, grain.spin, point.velocity, point.stress, point.pressure, cell.zone]"
    lab.run(name, folder, *lab.SMALL[name], "--set=time.end=10 ms", f"--set=output.fields={fields}")
    frames = expected(folder)
    counts = [{group: len(value["position"]) for group, value in groups.items()} for groups in frames.values()]
    assert len(set(map(str, counts))) > 1, "the counts do not change"
    print(f"{name}: {counts}")
    check_series(folder, frames)
    check_xdmf(folder, frames, "XDMFReader", lambda path: simple.XDMFReader(FileNames=[path]))
    check_xdmf(folder, frames, "Xdmf3ReaderS", lambda path: simple.Xdmf3ReaderS(FileName=[path]))
    check_xdmf(folder, frames, "Xdmf3ReaderT", lambda path: simple.Xdmf3ReaderT(FileName=[path]))


if __name__ == "__main__":
    print("ParaView", simple.GetParaViewVersion())
    for name in lab.SMALL:
        with lab.workplace() as place:
            check(name, pathlib.Path(place) / "run")
