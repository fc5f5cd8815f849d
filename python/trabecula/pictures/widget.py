"""The widget of notebooks, by anywidget (extra ``notebook``): the viewer of pages, its state shared with Python."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import anywidget
import traitlets

from .viewer import NAMES, View, checked, script, style

__all__ = ["Widget"]

#: What makes a module of the viewer's program: the figure, the mesh, and the state both ways.
MODULE = """
const NAMES = %s;
export default {
  async render({ model, el }) {
    el.innerHTML = model.get("_markup");
    const figure = el.querySelector("figure"), mesh = model.get("_mesh");
    const it = await view(figure, new Uint8Array(mesh.buffer, mesh.byteOffset, mesh.byteLength));
    if (!it) return;
    const pull = () => it.look(Object.fromEntries(NAMES.map((name) => [name, model.get(name)])));
    const push = () => {
      for (const [name, value] of Object.entries(it.seen())) model.set(name, value);
      model.save_changes();
    };
    pull();
    figure.addEventListener("look", push);
    for (const name of NAMES) model.on(`change:${name}`, pull);
    return () => {
      for (const name of NAMES) model.off(`change:${name}`, pull);
      it.close();
    };
  },
};
"""


class Widget(anywidget.AnyWidget):
    """The widget of a view. ``section`` (``"z<4"``, mm, or empty), ``azimuth``, ``elevation``, ``overhang`` (degrees), ``zoom``
    and ``color`` are traits: what is set is seen, what the user turns can be read and observed.
    """

    _esm = script() + MODULE % list(NAMES)
    _css = style()
    _mesh = traitlets.Bytes().tag(sync=True)
    _markup = traitlets.Unicode().tag(sync=True)
    section = traitlets.Unicode().tag(sync=True)
    azimuth = traitlets.Float().tag(sync=True)
    elevation = traitlets.Float().tag(sync=True)
    zoom = traitlets.Float().tag(sync=True)
    overhang = traitlets.Float().tag(sync=True)
    color = traitlets.Unicode().tag(sync=True)

    def __init__(self, view: View):
        self._view = view
        super().__init__(_mesh=view.stream, _markup=view.markup("480px"), **view.look)
        self.observe(lambda change: view.look.update({change["name"]: change["new"]}), list(NAMES))

    @traitlets.validate(*NAMES)
    def _checked(self, proposal: Mapping[str, Any]) -> Any:
        return checked(self._view, proposal["trait"].name, proposal["value"])
