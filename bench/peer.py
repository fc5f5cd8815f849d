"""One run of one other program, in its own process: python peer.py PEER WORKLOAD N OUT.stl"""

import sys

import workloads as w


def skimage(name, n, out):
    """scikit-image's marching cubes on a numpy array."""
    from skimage.measure import marching_cubes

    h = w.spacing(n)
    vertices, triangles, _, _ = marching_cubes(w.field(name, n), 0.0, spacing=(h, h, h))
    w.write_stl(out, vertices[:, ::-1] - h, triangles[:, ::-1])


def mcubes(name, n, out):
    """PyMCubes on a numpy array."""
    import mcubes as m

    vertices, triangles = m.marching_cubes(w.field(name, n), 0.0)
    w.write_stl(out, (vertices[:, ::-1] - 1) * w.spacing(n), triangles.astype("i8"))


def vtk(name, n, out):
    """VTK's flying edges with all threads, and VTK's own STL writer."""
    import os

    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkSMPTools
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D
    from vtkmodules.vtkIOGeometry import vtkSTLWriter

    vtkSMPTools.SetBackend("STDThread")
    vtkSMPTools.Initialize(os.cpu_count() or 1)
    f, h = w.field(name, n), w.spacing(n)
    image = vtkImageData()
    image.SetDimensions(n + 2, n + 2, n + 2)
    image.SetSpacing(h, h, h)
    image.SetOrigin(-h, -h, -h)
    image.GetPointData().SetScalars(numpy_to_vtk(f.ravel()))
    contour = vtkFlyingEdges3D()
    contour.SetInputData(image)
    contour.SetValue(0, 0.0)
    contour.ComputeNormalsOff()
    contour.ComputeGradientsOff()
    contour.ComputeScalarsOff()
    contour.Update()
    writer = vtkSTLWriter()
    writer.SetFileTypeToBinary()
    writer.SetInputData(contour.GetOutput())
    writer.SetFileName(out)
    writer.Write()


PEERS = {"skimage": skimage, "mcubes": mcubes, "vtk": vtk}

if __name__ == "__main__":
    PEERS[sys.argv[1]](sys.argv[2], int(sys.argv[3]), sys.argv[4])
