"""Pictures, drawings and viewers: of meshes and solids, of curves and distributions."""
