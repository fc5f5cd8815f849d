// The studio: a design's text, its picture while it changes, its figures, its mesh and files.
"use strict";

const START = `# A gyroid in a box. Change the text or the controls; each follows the other.
schema = 1
units = "mm"

[region.box]
size = [18, 18, 18]

[lattice.core]
cell = "gyroid"
part = "sheet"

[lattice.core.map.affine]
wavelength = 6

[lattice.core.level]
fraction = 0.3
`;
const MESHES = ["stl", "3mf", "ply", "obj", "off"];
/** Milliseconds that a picture may take while something moves, and at rest. */
const MOVING = 100, AT_REST = 700;
/** Milliseconds after which work on an older text is given up. */
const PATIENCE = 3000;
const LEAST = 12000, MOST = 600000;

const core = new Core();
const text = $("text");
const screen_ = viewer(document.querySelector("figure.viewer"));
const state = { name: "design", stale: false, busy: false, meshing: false, cells: 12000, bounds: null, opened: false, files: 0 };
const pause = (ms) => new Promise((done) => setTimeout(done, ms));
// What controls have changed and the text does not have yet: of each value the last change.
const pending = new Map();
// What marches through designs by rays, made when it is first wished; null where the graphics card does not take its program.
let rays;
const controls = new Controls((changes) => {
  for (const change of changes) {
    const place = change.path.join(".");
    pending.delete(place);
    pending.set(place, change);
  }
  changed();
});

// Whether rays are wished and can be had.
function byRays() {
  if ($("by").value !== "rays") return false;
  if (rays === undefined) {
    try {
      rays = screen_ && marcher(screen_.gl);
    } catch (error) {
      console.error(error);
      rays = null;
    }
  }
  if (!rays) $("by").value = "mesh";
  return !!rays;
}

function write(words) {
  text.value = words;
  lines();
  changed();
}

// What pictures say is not read aloud: there are many.
function say(words, aloud = true) {
  $("status").ariaLive = aloud ? "polite" : "off";
  $("status").textContent = words;
}

// --- the design, live ------------------------------------------------------------------------------------------------

function changed() {
  state.stale = true;
  $("made").hidden = true;
  if (!state.ready) return;
  if (state.meshing) return void stop().catch(broken);
  // What takes long is not waited for, since it is of an older text.
  if (core.busy > PATIENCE) core.restart().catch(broken);
  live().catch(broken);
}

async function live() {
  if (state.busy) return;
  state.busy = true;
  try {
    while (state.stale) {
      state.stale = false;
      if (await edited()) await show();
    }
  } catch (error) {
    if (error.name !== "stopped") throw error;
    state.stale = true;
  } finally {
    state.busy = false;
  }
  if (state.stale) return live();
}

// Brings what controls have changed into the text.
async function edited() {
  if (!pending.size) return true;
  const changes = [...pending.values()];
  pending.clear();
  if (text.value.trimStart().startsWith("{")) {
    say("controls change designs in TOML; this one is JSON, and is changed in its text");
    return true;
  }
  const { head } = await core.ask({ do: "edit", text: text.value, changes });
  if (head.error) { wrong(head.error); return false; }
  text.value = head.text;
  lines();
  return true;
}

async function show() {
  const { head } = await core.ask({ do: "open", text: text.value });
  if (head.error) return wrong(head.error);
  right();
  state.bounds = head.bounds;
  controls.read(head.data, head.bounds);
  state.warnings = head.warnings;
  keep();
  // While something moves there is a picture of each text that was read: a newer one waits for it.
  const live = await marched(head.data);
  if (!live) await picture(state.cells, true);
  await pause(state.opened ? 150 : 0);
  if (state.stale) return;
  if (!live && state.partly) await picture(state.cells, false);
  const partly = state.partly;
  if (state.stale) return;
  const figures = (await core.ask({ do: "figures" })).head;
  controls.facts = figures;
  facts(figures);
  if (state.stale) return;
  const finer = Math.min(MOST, (state.used * AT_REST) / Math.max(state.ms, 20));
  if (!live && !partly && finer > 1.5 * state.used) await picture(finer, false);
  state.opened = true;
}

// Draws the design by rays, where that is wished and the graphics card can march through it. It keeps the textures of a cell and of a
// region.
async function marched(data) {
  if (!byRays()) return false;
  const lattices = Object.values(data.lattice || {});
  if (lattices.length !== 1) return false;
  const [{ map, level, ...rest }] = lattices;
  const thick = level && "thickness" in level;
  // A wall's distances are those of a cell in the middle of the part.
  const cell = JSON.stringify([rest, thick && [map, data.region]]), region = JSON.stringify([data.region, state.files]);
  const { head, body, ms } = await core.ask({ do: "rays", cell: cell !== state.cell, region: region !== state.region });
  if (head.error || head.none) return false;
  rays.take(head, body);
  Object.assign(state, { cell, region, shown: null });
  const [min, max] = head.bounds, fraction = head.fractions && [0, 32].map((i) => head.fractions.values[i]).sort((a, b) => a - b);
  state.spans = { fraction, depth: [0, rays.deepest()] };
  colourable({ fraction: !!fraction, depth: true });
  scaled();
  screen_.paint({ min, max, span: null, spans: state.spans }, rays.painter);
  drawn(`picture by rays, ${Math.round(ms + rays.painter.ms)} ms`);
  return true;
}

async function picture(cells, moving) {
  const { head, body, ms } = await core.ask({ do: "picture", cells, part: moving && state.opened });
  if (head.error) return wrong(head.error);
  draw(head, body, head.bounds);
  [state.used, state.partly, state.ms] = [head.cells, head.part, ms];
  state.cells = Math.max(LEAST, Math.min(MOST / 6, (head.cells * MOVING) / Math.max(ms, 1)));
  const what = !head.part ? "picture" : moving ? "the middle, while it changes," : "the middle (the whole has too many triangles for a picture)";
  drawn(`${what}${head.edge ? ` at ${head.edge.toPrecision(2)} mm` : ""}, ${head.triangles.toLocaleString()} triangles, ${Math.round(ms)} ms`);
}

function drawn(words) {
  say(words, false);
  document.body.dataset.pictures = +(document.body.dataset.pictures || 0) + 1;
}

// A picture has no thickness, a mesh may be given it.
function draw({ vertices, triangles }, body, [min, max], thick = false) {
  if (!screen_ || !body.byteLength) return;
  const position = new Float32Array(body, 0, 3 * vertices), normal = new Int16Array(body, 12 * vertices, 4 * vertices);
  state.shown = [{ min, max, span: null }, { position, normal, index: new Uint32Array(body, 20 * vertices, 3 * triangles) }];
  state.spans = {};
  colourable({ values: thick });
  if (screen_.seen().color === "values") screen_.look({ color: "faces" });
  screen_.show(...state.shown);
}

// The colours that what is shown can have; one that it cannot have is left.
function colourable(has) {
  ["values", "fraction", "depth"].forEach((name, i) => {
    document.querySelector(`figure.viewer [name=colours] [value='${i + 2}']`).disabled = !has[name];
    if (screen_.seen().color === name && !has[name]) screen_.look({ color: "faces" });
  });
}

// The legend of the colours that are chosen of a picture by rays.
function scaled() {
  const color = screen_.seen().color, span = state.spans?.[color];
  if (span) legend(span, color === "depth" ? " mm" : "");
}

function legend([low, high], unit) {
  document.querySelector("[data-part=legend]").replaceChildren(low.toPrecision(3), document.createElement("i"), `${high.toPrecision(3)}${unit}`);
}

// The thickness of the mesh's walls as its colours, and a legend of them.
async function thickness() {
  if (state.shown[0].span) return;
  const found = await working(() => core.ask({ do: "thickness" }));
  if (!found) return screen_.look({ color: "faces" });
  const { head, body, ms } = found;
  if (head.error) { say(head.error.text); return screen_.look({ color: "faces" }); }
  legend(head.span, " mm");
  state.shown = [{ ...state.shown[0], span: head.span }, { ...state.shown[1], value: new Float32Array(body) }];
  screen_.show(...state.shown);
  screen_.look({ color: "values" });
  say(`wall thickness on voxels of ${head.step.toPrecision(2)} mm in ${(ms / 1000).toFixed(1)} s`);
}

// --- figures ---------------------------------------------------------------------------------------------------------

const number = (v) => (Math.abs(v) >= 1e5 || (v && Math.abs(v) < 1e-3) ? v.toExponential(3) : String(+v.toPrecision(5)));
const span = (v) => (Array.isArray(v) ? `${number(v[0])} – ${number(v[1])}` : number(v));

function rows(body, all) {
  body.replaceChildren(...all.filter(([, v]) => v !== null && v !== undefined && v !== "").map(([name, value, unit = "", title = ""]) => {
    const row = document.createElement("tr");
    for (const [tag, words] of [["th", name], ["td", `${value}${unit && ` ${unit}`}`]]) {
      const cell = document.createElement(tag);
      cell.textContent = words;
      if (tag === "th") { cell.scope = "row"; cell.title = title; }
      row.append(cell);
    }
    return row;
  }));
}

function facts(it) {
  const some = (v) => v !== null && v !== undefined;
  const table = [];
  const all = [["lattice", it.lattices], ["beams", it.beams]].flatMap(([kind, of]) => Object.entries(of).map(([name, l]) => [kind, name, l]));
  for (const [kind, name, l] of all) {
    const many = all.length > 1 ? `${name}: ` : "";
    const thinnest = kind === "beams" ? "thinnest beam" : l.part === "sheet" ? "thinnest wall" : "narrowest neck";
    table.push([`${many}solid fraction`, some(l.fraction) && span(l.fraction), "", "of the cell on the torus"]);
    table.push([`${many}${thinnest}`, some(l.thickness) && span(l.thickness), "mm"]);
    table.push([`${many}pore`, some(l.pore) && span(l.pore), "mm", "largest ball that passes between neighbouring cells"]);
    table.push([`${many}level t`, some(l.iso) && span(l.iso)]);
    if (l.connected_fraction) table.push([`${many}one piece`, `fraction ${l.connected_fraction.map((r) => r.map(number).join(" – ")).join(", ") || "never"}`, "", "fractions in which the periodic solid is one piece"]);
  }
  table.push(["region", some(it.region?.volume) && number(it.region.volume), "mm³"]);
  table.push(["grid of the mesh", some(it.spacing) && it.chord === null && number(it.spacing), "mm"]);
  rows($("facts"), table.filter((r) => r[1] !== false));
  const warnings = it.warnings?.length ? it.warnings : state.warnings;
  $("warnings").replaceChildren(...warnings.map((w) => Object.assign(document.createElement("li"), { textContent: `${w.path ? `${w.path}: ` : ""}${w.message}` })));
}

// --- errors ----------------------------------------------------------------------------------------------------------

function wrong(error) {
  $("error").textContent = error.text;
  $("error").hidden = false;
  text.setAttribute("aria-invalid", "true");
  state.line = error.line;
  lines();
  document.body.classList.add("wrong");
  $("mesh").disabled = true;
  say("the design has an error");
}

function right() {
  $("error").hidden = true;
  text.removeAttribute("aria-invalid");
  state.line = null;
  lines();
  document.body.classList.remove("wrong");
  $("mesh").disabled = false;
}

function broken(error) {
  if (error.name === "stopped") return;
  console.error(error);
  wrong({ text: error.message, line: null });
}

// Numbers of lines, and a mark at the line of the error.
function lines() {
  const count = text.value.split("\n").length;
  $("lines").replaceChildren(...Array.from({ length: count }, (_, i) => {
    const line = Object.assign(document.createElement("span"), { textContent: i + 1 });
    if (i + 1 === state.line) line.className = "wrong";
    return line;
  }));
  $("lines").style.transform = `translateY(${-text.scrollTop}px)`;
}

// --- the mesh --------------------------------------------------------------------------------------------------------

async function stop() {
  state.meshing = false;
  await core.restart();
  say("stopped");
}

// Work of the core with progress, which can be cancelled: what it gives, or null if it was, and the mesh lost with it.
async function working(work) {
  if (state.asked) return null;
  state.asked = true;
  while (state.busy) await pause(20);
  state.busy = state.meshing = true;
  for (const id of ["progress", "cancel"]) $(id).hidden = false;
  $("mesh").hidden = true;
  $("progress").value = 0;
  core.onprogress = (share) => { $("progress").value = share; };
  let found = null;
  try {
    found = await work();
  } catch (error) {
    if (error.name !== "stopped") throw error;
    state.stale = true;
    $("made").hidden = true;
  } finally {
    state.busy = state.meshing = state.asked = false;
    for (const id of ["progress", "cancel"]) $(id).hidden = true;
    $("mesh").hidden = false;
  }
  if (state.stale) await live();
  return found;
}

async function mesh() {
  if ($("mesh").disabled) return;
  const per = +$("edge").value;
  const found = await working(() => core.ask({ do: "mesh", edge: per > 0 ? per : null, per_cell: null }));
  if (!found) return;
  const { head, body, ms } = found;
  if (head.error) {
    $("error").textContent = head.error.text;
    $("error").hidden = false;
    return say("no mesh");
  }
  if (head.drawn) draw(head, body, state.bounds, true);
  made(head, ms);
}

function made(head, ms) {
  const it = head.figures;
  rows($("measures"), [
    ["triangles", head.triangles.toLocaleString()],
    [head.chord ? "chord error" : "grid", number(head.edge || head.chord), "mm"],
    ["volume", number(it.volume), "mm³"], ["solid fraction", it.solid_fraction && number(it.solid_fraction)],
    ["area", number(it.area), "mm²"], ["pieces", it.pieces], ["closed voids", it.cavities || null],
    ["closed", it.closed ? "yes" : "no"], ["Euler number", it.euler],
    ["hydraulic diameter", it.hydraulic_diameter && number(it.hydraulic_diameter), "mm"],
  ]);
  $("notes").replaceChildren(...head.notes.map((words) => Object.assign(document.createElement("li"), { textContent: words })));
  $("made").hidden = false;
  say(`mesh made in ${(ms / 1000).toFixed(2)} s${head.drawn ? "" : "; too large to be drawn: the picture stays"}`);
  document.body.dataset.meshed = head.triangles;
}

function download(bytes, name, type) {
  const link = Object.assign(document.createElement("a"), { download: name, href: URL.createObjectURL(new Blob([bytes], { type })) });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

async function save(suffix) {
  const { head, body } = await core.ask({ do: "write", suffix });
  if (head.error) return wrong(head.error);
  download(body, `${state.name}.${suffix}`, suffix === "stl" ? "model/stl" : "model/3mf");
}

// --- files and the address -------------------------------------------------------------------------------------------

async function take(files) {
  for (const file of files) {
    const suffix = file.name.split(".").pop().toLowerCase();
    if (suffix === "toml" || suffix === "json") {
      state.name = file.name.replace(/\.[^.]*$/, "");
      write(await file.text());
      continue;
    }
    await core.file(file.name, new Uint8Array(await file.arrayBuffer()));
    state.files++;
    if (!MESHES.includes(suffix)) { say(`${file.name} is there for the design`); changed(); continue; }
    // A part that the design names already is read anew; another becomes the region.
    if (text.value.includes(file.name)) { changed(); continue; }
    const changes = controls.region("mesh", { path: file.name });
    const { head } = await core.ask({ do: "edit", text: text.value, changes });
    if (head.error) wrong(head.error); else write(head.text);
  }
}

const packed = async (words, way) => new Uint8Array(await new Response(new Blob([words]).stream().pipeThrough(way)).arrayBuffer());

async function link() {
  const bytes = await packed(text.value, new CompressionStream("deflate-raw"));
  const letters = btoa(Array.from(bytes, (b) => String.fromCharCode(b)).join("")).replace(/\+/g, "-").replace(/\//g, "_").replace(/=+$/, "");
  return `#d=${letters}`;
}

let written = "";
let later = 0;
function keep() {
  clearTimeout(later);
  later = setTimeout(async () => {
    written = await link();
    history.replaceState(null, "", written);
  }, 300);
}

async function share() {
  written = await link();
  history.replaceState(null, "", written);
  try {
    await navigator.clipboard.writeText(location.href.replace("?design", ""));
    say("the address of this design is copied");
  } catch {
    say("the address above is that of this design; this browser lets no page copy it");
  }
}

async function fromAddress() {
  const found = /#d=([\w-]+)/.exec(location.hash);
  if (!found || location.hash === written) return null;
  try {
    const bytes = Uint8Array.from(atob(found[1].replace(/-/g, "+").replace(/_/g, "/")), (c) => c.charCodeAt(0));
    return new TextDecoder().decode(await packed(bytes, new DecompressionStream("deflate-raw")));
  } catch {
    say("the address has no readable design");
    return null;
  }
}

// The design that `trabecula studio DESIGN` serves, with the files that it names; these are there after a reload too.
async function fromCommand() {
  if (!new URLSearchParams(location.search).has("design")) return null;
  const given = await (await fetch("design.json")).json();
  state.name = given.name;
  for (const { name, url } of given.files) await core.file(name, new Uint8Array(await (await fetch(url)).arrayBuffer()));
  return given.text;
}

async function begin() {
  text.addEventListener("input", () => { lines(); changed(); });
  text.addEventListener("scroll", lines);
  $("mesh").addEventListener("click", () => mesh().catch(broken));
  // After the viewer, which listens to the figure too.
  document.querySelector("figure.viewer").addEventListener("input", (e) => {
    if (e.target.name === "colours") screen_.seen().color === "values" ? thickness().catch(broken) : scaled();
  });
  // Without a graphics card meshes are drawn faster. The card makes its program while the core is unpacked.
  $("by").value = screen_ && !drawnBySoftware() ? "rays" : "mesh";
  byRays();
  $("by").addEventListener("input", (e) => { e.stopPropagation(); changed(); });
  $("cancel").addEventListener("click", () => stop().catch(broken));
  $("stl").addEventListener("click", () => save("stl").catch(broken));
  $("three").addEventListener("click", () => save("3mf").catch(broken));
  $("open").addEventListener("click", () => $("file").click());
  $("toml").addEventListener("click", () => download(text.value, `${state.name}.toml`, "text/plain"));
  $("file").addEventListener("change", (e) => { take([...e.target.files]).catch(broken); e.target.value = ""; });
  $("share").addEventListener("click", () => share().catch(broken));
  addEventListener("dragover", (e) => { e.preventDefault(); document.body.classList.add("over"); });
  addEventListener("dragleave", (e) => { if (!e.relatedTarget) document.body.classList.remove("over"); });
  addEventListener("drop", (e) => { e.preventDefault(); document.body.classList.remove("over"); take([...e.dataTransfer.files]).catch(broken); });
  addEventListener("hashchange", async () => { const found = await fromAddress(); if (found !== null && found !== text.value) write(found); });
  addEventListener("keydown", (e) => {
    if (e.key === "Enter" && (e.ctrlKey || e.metaKey)) { e.preventDefault(); mesh().catch(broken); }
    if (e.key === "Escape" && state.meshing) stop().catch(broken);
  });
  if (!screen_) document.querySelector("figure.viewer").classList.add("still");
  const own = await fromAddress();
  text.value = own ?? START;
  lines();
  await core.restart();
  controls.fill((await core.ask({ do: "catalogue" })).head);
  const served = await fromCommand();
  text.value = own ?? served ?? START;
  lines();
  state.ready = true;
  changed();
}

begin().catch(broken);
