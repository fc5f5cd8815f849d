"""XDMF 3 with HDF5: meshes for finite elements as two files, for ParaView, dolfinx and meshio."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

from ..base.files import whole_file, write_text

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from ..finite_elements import FiniteElements

__all__ = ["write"]

#: XDMF's names of elements by their number of nodes; the order of nodes is VTK's.
TOPOLOGY = {4: "Tetrahedron", 8: "Hexahedron", 10: "Tetrahedron_10"}
#: XDMF's names of numbers by NumPy's kinds.
NUMBERS = {"f": "Float", "u": "UInt"}
#: XDMF's names of attributes by the number of their components.
ATTRIBUTES = {1: "Scalar", 3: "Vector", 6: "Tensor6", 9: "Tensor"}


def write(path: str, mesh: FiniteElements, fields: dict[str, NDArray]) -> None:
    """Writes ``path`` and, with the arrays, a file of the same name that ends in .h5.

    ``fields`` are further numbers at nodes or in elements; each set is a field of nodes and one of elements, 1 in it and 0
    elsewhere.
    """
    try:
        import h5py
    except ImportError:
        raise ValueError(".xdmf files need h5py, which is not installed: pip install h5py") from None
    import numpy as np

    heavy = os.path.splitext(path)[0] + ".h5"
    nodes, elements = mesh.nodes, mesh.elements
    attributes = [(name, "Cell", values) for name, values in mesh._of_elements().items()]
    for name, of in mesh.sets.items():
        for center, count, members in (("Node", len(nodes), of.nodes), ("Cell", len(elements), of.elements)):
            flags = np.zeros(count, dtype=np.uint8)
            flags[members] = 1
            attributes.append((name, center, flags))
    attributes += [(name, "Node" if len(v) == len(nodes) else "Cell", v) for name, v in fields.items()]
    lines = ['<Xdmf Version="3.0"><Domain><Grid Name="mesh" GridType="Uniform">']
    if names := mesh._names_of_domains():
        # As meshio has names of numbers.
        named = "".join(f'<map key="{name}" dim="3">{number}</map>' for number, name in enumerate(names))
        lines.append(f'<Information Name="domains" Value="{len(names)}"><![CDATA[<main>{named}</main>]]></Information>')
    with whole_file(heavy) as temporary, h5py.File(temporary, "w") as store:

        def item(name: str, values: np.ndarray) -> str:
            store.create_dataset(name, data=values)
            size = " ".join(map(str, values.shape))
            kind = f'NumberType="{NUMBERS[values.dtype.kind]}" Precision="{values.dtype.itemsize}"'
            place = quoteattr(f"{os.path.basename(heavy)}:/{name}")[1:-1]
            return f'<DataItem Dimensions="{size}" {kind} Format="HDF">{place}</DataItem>'

        lines.append(f'<Geometry GeometryType="XYZ">{item("nodes", nodes)}</Geometry>')
        topology = f'TopologyType="{TOPOLOGY[elements.shape[1]]}" NumberOfElements="{len(elements)}"'
        lines.append(f"<Topology {topology}>{item('elements', elements)}</Topology>")
        for k, (name, center, values) in enumerate(attributes):
            kind = ATTRIBUTES.get(values[0].size, "Matrix")
            head = f'<Attribute Name={quoteattr(name)} AttributeType="{kind}" Center="{center}">'
            lines.append(f"{head}{item(f'data{k}', values)}</Attribute>")
    lines.append("</Grid></Domain></Xdmf>")
    write_text(path, "\n".join(lines) + "\n")
