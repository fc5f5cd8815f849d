// Controls over the text of a design: they are set by what the core has read in it, and change it value by value.
"use strict";

const $ = (id) => document.getElementById(id);
const AMOUNTS = {
  fraction: { words: "Solid fraction", min: 0.02, max: 0.95, step: 0.005, unit: "", usual: 0.3 },
  porosity: { words: "Porosity", min: 0.05, max: 0.98, step: 0.005, unit: "", usual: 0.7 },
  thickness: { words: "Wall thickness", min: 0.1, max: 3, step: 0.01, unit: "mm", usual: 0.6 },
  iso: { words: "Level t", min: 0, max: 1.5, step: 0.005, unit: "", usual: 0.4 },
};
const SHAPES = {
  box: { size: [20, 20, 20] },
  sphere: { radius: 10 },
  cylinder: { base: [0, 0, -10], radius: 8, height: 20 },
};
const tidy = (v) => +(+v).toPrecision(6);
const isRamp = (v) => v && typeof v === "object" && v.linear && v.linear.stops?.length === 2 && `${v.linear.along}` === "0,0,1";
const numbers = (v) => (Array.isArray(v) ? v : [v, v, v]);

class Controls {
  // `change(changes)` is called with what is to change in the text.
  constructor(change) {
    this.change = change;
    this.data = null;
    document.getElementById("controls").addEventListener("input", (e) => this.moved(e.target));
  }

  fill(catalogue) {
    const option = (c, kind) => new Option(c.title || c.name, `${kind}:${c.name}`);
    for (const [label, kind, rows] of [["Surfaces", "lattice", catalogue.cells], ["Beams", "beams", catalogue.beams]]) {
      const group = Object.assign(document.createElement("optgroup"), { label });
      group.append(...rows.map((c) => option(c, kind)));
      $("cell").append(group);
    }
  }

  // The table and the name of what the controls are of.
  get place() {
    const chosen = $("which").value;
    return chosen ? chosen.split("/") : null;
  }

  get item() {
    const at = this.place;
    return at && this.data[at[0]][at[1]];
  }

  read(data, bounds) {
    this.data = data;
    this.bounds = bounds;
    const names = ["lattice", "beams"].flatMap((kind) => Object.keys(data[kind] || {}).map((name) => `${kind}/${name}`));
    const old = $("which").value;
    $("which").replaceChildren(...names.map((n) => new Option(n.split("/")[1], n)));
    if (names.includes(old)) $("which").value = old;
    $("which-row").hidden = names.length < 2;
    const item = this.item, beams = this.place?.[0] === "beams";
    this.put("cell", typeof item.cell === "string" ? `${this.place[0]}:${item.cell}` : "own");
    $("part-row").hidden = beams || typeof item.part !== "string";
    this.put("part", item.part);
    this.readAmount(item, beams);
    this.readMap(item.map);
    this.readRegion(data.region);
    const skin = data.skin && typeof data.skin.thickness === "number" ? data.skin.thickness : null;
    $("skin").checked = !!data.skin;
    $("skin-row").hidden = skin === null;
    if (skin !== null) this.put("skin-value", skin);
  }

  // A control that is in use is left alone.
  put(id, value) {
    const it = $(id);
    if (document.activeElement === it || value === undefined || value === null) return;
    if (it.type === "range" && +value > +it.max) it.max = tidy(1.5 * value);
    it.value = typeof value === "number" ? tidy(value) : value;
    if (it.tagName === "SELECT" && it.selectedIndex < 0) it.value = "own";
  }

  readAmount(item, beams) {
    const of = beams ? item : item.level || {};
    const kind = beams ? ["radius", "fraction"].find((k) => k in of) : Object.keys(AMOUNTS).find((k) => k in of);
    const value = kind && of[kind];
    const known = kind && (typeof value === "number" || isRamp(value));
    $("amount-row").hidden = !known;
    $("ramp-row").hidden = !known;
    $("amount-kind").querySelectorAll("option").forEach((o) => { o.hidden = o.disabled = beams ? o.value !== "radius" && o.value !== "fraction" : o.value === "radius"; });
    if (!known) return;
    const range = kind === "radius" ? { min: 0.05, max: 2, step: 0.01, unit: "mm" } : AMOUNTS[kind];
    const ends = isRamp(value) ? value.linear.stops.map((s) => s[1]) : [value, value];
    this.put("amount-kind", kind);
    $("ramp").checked = isRamp(value);
    $("top-row").hidden = !isRamp(value);
    $("amount-of").textContent = range.unit;
    $("amount-kind").title = isRamp(value) ? "at the bottom" : "";
    for (const [id, v] of [["amount", ends[0]], ["top", ends[1]]]) {
      if (document.activeElement !== $(id)) Object.assign($(id), { min: range.min, max: Math.max(range.max, v), step: range.step });
      this.put(id, v);
      this.put(`${id}-number`, v);
    }
  }

  readMap(map) {
    const affine = map?.affine || map?.spartan;
    const known = affine && affine.wavelength !== undefined && numbers(affine.wavelength).every((v) => typeof v === "number");
    $("waves").hidden = !known;
    if (!known) return;
    const w = numbers(affine.wavelength), apart = Array.isArray(affine.wavelength);
    if (!this.holds("apart")) $("apart").checked = apart;
    ["wx", "wy", "wz"].forEach((id, a) => { this.put(id, w[a]); this.put(`${id}-number`, w[a]); });
    $("wy-row").hidden = $("wz-row").hidden = !$("apart").checked;
    $("wx-name").textContent = $("apart").checked ? "along x" : "Wavelength";
    const turned = numbers(affine.rotate ?? 0);
    ["rx", "ry", "rz"].forEach((id, a) => this.put(id, turned[a]));
  }

  holds(id) {
    return document.activeElement === $(id);
  }

  readRegion(region) {
    const kind = Object.keys(region)[0], it = region[kind];
    const known = { box: Array.isArray(it.size), sphere: typeof it.radius === "number", cylinder: typeof it.height === "number", mesh: true }[kind];
    this.put("region", known ? kind : "own");
    for (const row of document.querySelectorAll("[data-of]")) row.hidden = row.dataset.of !== (known ? kind : "");
    if (kind === "box" && known) ["sx", "sy", "sz"].forEach((id, a) => this.put(id, it.size[a]));
    if (kind === "sphere") this.put("sphere-radius", it.radius);
    if (kind === "cylinder" && known) { this.put("cylinder-radius", it.radius); this.put("cylinder-height", it.height); }
    if (kind === "mesh") $("mesh-name").textContent = it.path;
  }

  // What a control changes.
  moved(control) {
    const pair = control.id.endsWith("-number") ? control.id.slice(0, -7) : `${control.id}-number`;
    if ($(pair) && control.value !== "") $(pair).value = control.value;
    const of = control.id.replace(/-number$/, "");
    if ((control.type === "number" || control.type === "range") && (control.value === "" || !Number.isFinite(+control.value))) return;
    if (!this.data || !this.place) return;
    const [kind, name] = this.place, at = [kind, name];
    const changes = {
      which: () => { this.read(this.data, this.bounds); return []; },
      cell: () => this.ofCell(kind, name, control.value),
      part: () => [{ path: [...at, "part"], value: control.value }],
      "amount-kind": () => this.ofKind(at, control.value),
      amount: () => this.ofAmount(), top: () => this.ofAmount(), ramp: () => this.ofAmount(),
      wx: () => this.ofWaves(), wy: () => this.ofWaves(), wz: () => this.ofWaves(), apart: () => this.ofWaves(),
      rx: () => this.ofTurn(), ry: () => this.ofTurn(), rz: () => this.ofTurn(),
      region: () => this.ofRegion(control.value),
      sx: () => this.ofSize(), sy: () => this.ofSize(), sz: () => this.ofSize(),
      "sphere-radius": () => [{ path: ["region", "sphere", "radius"], value: +control.value }],
      "cylinder-radius": () => [{ path: ["region", "cylinder", "radius"], value: +control.value }],
      "cylinder-height": () => [{ path: ["region", "cylinder", "height"], value: +control.value }],
      skin: () => [{ path: ["skin"], value: control.checked ? { thickness: +$("skin-value").value || 0.6 } : null, heading: true }],
      "skin-value": () => [{ path: ["skin", "thickness"], value: +control.value }],
    }[of]?.();
    if (changes?.length) this.change(changes);
  }

  ofCell(kind, name, chosen) {
    const [to, cell] = chosen.split(":");
    if (to === "own") return [];
    if (to === kind) return [{ path: [kind, name, "cell"], value: cell }];
    // From a surface to beams or back: the map stays, the amount is another.
    const wavelength = numbers(this.item.map?.affine?.wavelength ?? 5)[0];
    const made = to === "beams"
      ? { cell, map: { affine: { wavelength } }, radius: tidy(0.08 * wavelength) }
      : { cell, part: "sheet", map: { affine: { wavelength } }, level: { fraction: 0.3 } };
    const alone = Object.keys(this.data[kind]).length === 1;
    return [{ path: alone ? [kind] : [kind, name], value: null }, { path: [to, name], value: made, heading: true }];
  }

  get amountAt() {
    return this.place[0] === "beams" ? [...this.place] : [...this.place, "level"];
  }

  ofKind(at, kind) {
    const old = [...$("amount-kind").options].map((o) => o.value);
    const waves = numbers(this.item.map?.affine?.wavelength ?? 5)[0];
    const facts = this.facts?.[at[0] === "beams" ? "beams" : "lattices"]?.[at[1]];
    // The same solid by another amount, where its figure is known.
    const known = { porosity: facts && 1 - facts.fraction, fraction: facts?.fraction, thickness: facts?.thickness, iso: facts?.iso }[kind];
    const usual = kind === "radius" ? 0.08 * waves : AMOUNTS[kind].usual;
    const value = tidy(Number.isFinite(known) && known > 0 ? (+known).toPrecision(3) : usual);
    document.activeElement?.blur();
    return [...old.map((k) => ({ path: [...this.amountAt, k], value: null })), { path: [...this.amountAt, kind], value }];
  }

  ofAmount() {
    const [low, high] = [tidy($("amount").value), tidy($("top").value)];
    const stops = [[tidy(this.bounds[0][2]), low], [tidy(this.bounds[1][2]), high]];
    const value = $("ramp").checked ? { linear: { along: [0, 0, 1], stops } } : low;
    return [{ path: [...this.amountAt, $("amount-kind").value], value }];
  }

  get mapAt() {
    return [...this.place, "map", this.item.map.spartan ? "spartan" : "affine"];
  }

  ofWaves() {
    const w = ["wx", "wy", "wz"].map((id) => tidy($(id).value));
    return [{ path: [...this.mapAt, "wavelength"], value: $("apart").checked ? w : w[0] }];
  }

  ofTurn() {
    const turned = ["rx", "ry", "rz"].map((id) => tidy($(id).value || 0));
    return [{ path: [...this.mapAt, "rotate"], value: turned.some(Boolean) ? turned : null }];
  }

  ofRegion(kind) {
    if (kind === "mesh") { $("file").click(); return []; }
    if (!SHAPES[kind]) return [];
    return this.region(kind, SHAPES[kind]);
  }

  // Another region in the place of the one that is there.
  region(kind, value) {
    const others = Object.keys(this.data?.region || {});
    return [...others.map((k) => ({ path: ["region", k], value: null })), { path: ["region", kind], value, heading: true }];
  }

  ofSize() {
    return [{ path: ["region", "box", "size"], value: ["sx", "sy", "sz"].map((id) => tidy($(id).value)) }];
  }
}
