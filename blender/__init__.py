"""Extension of Blender: fills the active mesh object with a lattice. One panel, in the tab Trabecula of the sidebar."""

import os
import tempfile
import warnings
from functools import cache

import bpy
import numpy as np

#: Beams stand in the list of cells behind this.
BEAMS = "beams:"
#: What of a cell is solid.
PARTS = (
    ("sheet", "Sheet", "A wall along the surface, between two labyrinths"),
    ("lower", "Network", "All on one side of the surface"),
    ("upper", "Other network", "All on the other side of it"),
)


@cache
def known():
    """Named cells, then unit cells of beams. Blender does not keep these texts: somebody else has to."""
    import trabecula as lt

    named = [(name, name.replace("_", " ").capitalize(), "") for name in lt.cell.names()]
    return named + [(BEAMS + name, "Beams: " + name.replace("_", " "), "") for name in lt.beams.names()]


def cells(_, context):
    """The items of the list of cells."""
    return known()


class Settings(bpy.types.PropertyGroup):
    """What the panel asks for; lengths in mm."""

    cell: bpy.props.EnumProperty(name="Cell", items=cells, description="The cell that is repeated")
    part: bpy.props.EnumProperty(name="Solid", items=PARTS, description="Which part of the cell is solid; not of beams")
    wavelength: bpy.props.FloatProperty(name="Cell size (mm)", default=5.0, min=0.01, description="Edge of one cell")
    fraction: bpy.props.FloatProperty(
        name="Solid fraction", default=0.3, min=0.01, max=0.95, description="Share of the volume that is solid, met exactly"
    )
    skin: bpy.props.FloatProperty(name="Skin (mm)", default=0.0, min=0.0, description="Solid below the surface; 0: none")
    samples: bpy.props.IntProperty(
        name="Samples per cell", default=24, min=8, max=128, description="Grid steps on a cell; 32 and more for printing"
    )
    unit: bpy.props.EnumProperty(
        name="Unit",
        items=(
            ("mm", "1 unit is 1 mm", "As parts for printing are mostly modelled"),
            ("scene", "As the scene says", "By the unit scale of the scene: 1 unit is 1 m unless it is changed"),
        ),
    )


def design_of(part, settings):
    """The design of a region's file with the settings of the panel."""
    import trabecula as lt

    size = lt.map.affine(wavelength=settings.wavelength)
    if settings.cell.startswith(BEAMS):
        filled = {"beams": lt.Beams(cell=settings.cell.removeprefix(BEAMS), map=size, fraction=settings.fraction)}
    else:
        level = lt.level.fraction(settings.fraction)
        filled = {"lattice": {"core": lt.Lattice(cell=settings.cell, part=settings.part, map=size, level=level)}}
    skin = lt.skin(thickness=settings.skin) if settings.skin > 0 else None
    return lt.Design(region=lt.region.mesh(part), skin=skin, **filled)


def triangles_of(part, context, scale):
    """Vertices in mm and triangles of an object as it is seen: with its modifiers, in the world."""
    seen = part.evaluated_get(context.evaluated_depsgraph_get())
    mesh = seen.to_mesh()
    try:
        mesh.calc_loop_triangles()
        vertices = np.empty((len(mesh.vertices), 3))
        mesh.vertices.foreach_get("co", vertices.ravel())
        triangles = np.empty((len(mesh.loop_triangles), 3), dtype=np.int32)
        mesh.loop_triangles.foreach_get("vertices", triangles.ravel())
    finally:
        seen.to_mesh_clear()
    place = np.array(seen.matrix_world)
    world = vertices @ place[:3, :3].T + place[:3, 3]
    mirrored = np.linalg.det(place[:3, :3]) < 0
    return world * scale, triangles[:, ::-1] if mirrored else triangles


def object_of(made, name, scale):
    """A mesh of ours as an object at the world's origin."""
    vertices, triangles = made.vertices / scale, made.triangles.astype(np.int32)
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(vertices))
    mesh.vertices.foreach_set("co", vertices.astype(np.float32).ravel())
    mesh.loops.add(triangles.size)
    mesh.loops.foreach_set("vertex_index", triangles.ravel())
    mesh.polygons.add(len(triangles))
    mesh.polygons.foreach_set("loop_start", np.arange(0, triangles.size, 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    return bpy.data.objects.new(name, mesh)


class Fill(bpy.types.Operator):
    """Fill the active mesh object with a lattice; it is hidden, and the lattice is an object of its own"""

    bl_idname = "object.trabecula_fill"
    bl_label = "Fill with a lattice"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012  as Blender reads it

    @classmethod
    def poll(cls, context):
        """Whether a mesh object is active."""
        return context.object is not None and context.object.type == "MESH" and context.mode == "OBJECT"

    def execute(self, context):
        """Meshes the lattice."""
        import trabecula as lt

        part, settings = context.object, context.scene.trabecula
        scale = 1.0 if settings.unit == "mm" else 1000.0 * context.scene.unit_settings.scale_length
        window = context.window_manager
        window.progress_begin(0, 1000)
        try:
            with tempfile.TemporaryDirectory(prefix="trabecula-") as folder, warnings.catch_warnings(record=True) as found:
                warnings.simplefilter("always", lt.DesignWarning)
                name = os.path.join(folder, "part.ply")
                lt.Mesh.of(*triangles_of(part, context, scale)).write(name)
                solid = design_of(name, settings).build()
                made = solid.mesh(
                    per_cell=settings.samples, progress=lambda done, of: window.progress_update(1000 * done // of)
                )
        except (ValueError, MemoryError) as error:
            self.report({"ERROR"}, f"Trabecula: {error}".replace(folder + os.sep, ""))
            return {"CANCELLED"}
        finally:
            window.progress_end()
        for warning in found:
            self.report({"WARNING"}, f"Trabecula: {warning.message}")
        lattice = object_of(made, f"{part.name} lattice", scale)
        for collection in part.users_collection or (context.scene.collection,):
            collection.objects.link(lattice)
        part.hide_set(True)
        context.view_layer.objects.active = lattice
        lattice.select_set(True)
        share = made.volume / solid.region_volume()
        self.report({"INFO"}, f"{made.volume:.4g} mm³, {share:.1%} of the part, {made.counts[1]} triangles")
        return {"FINISHED"}


class Panel(bpy.types.Panel):
    """The panel of the sidebar."""

    bl_idname = "VIEW3D_PT_trabecula"
    bl_label = "Lattice"
    bl_category = "Trabecula"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"

    def draw(self, context):
        """Settings, then the button."""
        settings, column = context.scene.trabecula, self.layout.column()
        column.use_property_split = True
        for key in ("cell", "part", "wavelength", "fraction", "skin", "samples", "unit"):
            row = column.row()
            row.enabled = key != "part" or not settings.cell.startswith(BEAMS)
            row.prop(settings, key)
        column.operator(Fill.bl_idname, icon="MOD_LATTICE")


CLASSES = (Settings, Fill, Panel)


def register():
    """Adds panel and operator."""
    for one in CLASSES:
        bpy.utils.register_class(one)
    bpy.types.Scene.trabecula = bpy.props.PointerProperty(type=Settings)


def unregister():
    """Takes them away."""
    del bpy.types.Scene.trabecula
    for one in reversed(CLASSES):
        bpy.utils.unregister_class(one)
