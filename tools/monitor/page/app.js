// The page: receives messages of the server and shows the latest state.
import { ChannelPanel } from "./channels.js";
import { map, paint } from "./colors.js";
import { ComponentChooser } from "./components.js";
import { DistanceChart, ForecastChart, ProbabilityChart } from "./charts.js";
import { connect, readPacket } from "./connection.js";
import { ForecastPanel } from "./forecast.js";
import { byId, HealthBar, ParameterTable, VerdictPanel } from "./panels.js";
import { Plane } from "./plane.js";
import { Rows } from "./rows.js";
import { Scene3d } from "./scene3d.js";
import { Timeline } from "./timeline.js";

const chartInterval = 200, wordsInterval = 100, farFromServer = 3000;  // ms
const isChecked = (id) => byId(id).checked;

// The processor draws 2D canvases. With the graphics processor, the page would wait until all earlier drawing is done, including
// the 3D view: seconds on a busy machine that renders in software.
const { getContext } = HTMLCanvasElement.prototype;
HTMLCanvasElement.prototype.getContext = function (kind, options) {
  return getContext.call(this, kind, kind === "2d" ? { willReadFrequently: true, ...options } : options);
};

/// The fields of all components by name and unit, each with a range over all and its place in each component's model.
function fieldsOf(models) {
  const fields = new Map();
  models.forEach((model, i) =>
    model.fields.forEach((field, place) => {
      const key = JSON.stringify([field.name, field.unit]), { lo, hi, places } = fields.get(key) ?? { ...field, places: [] };
      places[i] = place;
      fields.set(key, { name: field.name, unit: field.unit, lo: Math.min(lo, field.lo), hi: Math.max(hi, field.hi), places });
    }),
  );
  return [...fields.values()];
}

class Page {
  /// models: of each component. The panels show the one in front.
  constructor(models) {
    this.models = models;
    this.model = models[0];
    this.front = 0;
    this.fields = fieldsOf(models);
    this.rowsOf = models.map(() => new Rows());
    this.snapshot = null;
    this.isStale = { scene: false, charts: false, words: false };
    this.nextWords = 0;
    this.awaiting = [];
    this.scene = new Scene3d(byId("canvas"), models);
    const nameOf = (simulation) => this.model.simulations[simulation]?.name ?? `#${simulation}`, { unit } = this.model;
    this.probability = new ProbabilityChart(byId("probability-chart"), byId("probability-list"), nameOf);
    this.distance = new DistanceChart(byId("distance-chart"), byId("distance-title"), unit);
    this.forecastChart = new ForecastChart(byId("forecast-chart"), unit);
    this.plane = new Plane(byId("plane"), this.model);
    this.verdict = new VerdictPanel(this.model);
    this.parameters = new ParameterTable(this.model);
    this.forecast = new ForecastPanel(this.model);
    this.showChannels();
    this.health = new HealthBar();
    this.addColors();
    this.addControls();
    const changed = () => (this.isStale.scene = this.snapshot !== null);
    this.chooser = new ComponentChooser(models.map(({ name }) => name), { changed, chosen: (i) => this.chooseFront(i) });
    addEventListener("resize", () => (this.isStale.charts = true));
    setInterval(() => this.drawCharts(), chartInterval);
    const loop = () => {
      requestAnimationFrame(loop);
      if (this.isStale.scene && this.scene.isFree()) this.drawScene();
      // A requested frame is described when it is drawn.
      if (this.isStale.words && this.awaiting.length === 0 && performance.now() >= this.nextWords) this.showWords();
    };
    loop();
  }
  addColors() {
    const options = this.fields.map((field, i) => [`field${i}`, field.name.replaceAll("_", " ")]);
    options.push(["distance", "distance cloud to mesh"], ["none", "uniform"]);
    byId("color").replaceChildren(...options.map(([value, textContent]) => Object.assign(document.createElement("option"), { value, textContent })));
  }
  addControls() {
    for (const id of ["show-cloud", "show-mesh", "show-edges", "show-ghost", "show-final", "side-by-side", "mesh-kind", "color"])
      byId(id).addEventListener("change", () => (this.isStale.scene = this.isStale.words = this.snapshot !== null));
    byId("fit-view").addEventListener("click", () => this.scene.fit());
    byId("save-png").addEventListener("click", () => this.savePicture());
  }
  showChannels() {
    this.channels?.close();
    this.channels = new ChannelPanel(this.model.channels, () => (this.isStale.charts = true));
  }
  /// The results of this component in the panels.
  chooseFront(i) {
    this.front = i;
    this.model = this.models[i];
    this.verdict.model = this.model;
    this.parameters = new ParameterTable(this.model);
    this.forecast = new ForecastPanel(this.model);
    this.showChannels();
    this.plane.take(this.model);
    this.plane.recolor();
    byId("verdict-panel").ariaLabel = `Verdict of ${this.model.name}`;
    this.isStale.charts = true;
    this.isStale.words = this.isStale.scene = this.snapshot !== null;
  }
  receive(packet) {
    packet.parts.forEach((part, i) => part.head.type === "rows" && this.receiveRows(i, part));
    if (packet.parts[0]?.head.type !== "snapshot") return;
    this.snapshot = packet;
    this.isStale.words = true;
    // Between frames most snapshots differ only in the ages of the messages.
    const scenes = packet.parts.map(({ head }) => [head.test.session, head.scene]), shown = JSON.stringify([scenes, packet.head.scene, packet.arrays.cloud?.length]);
    this.isStale.scene ||= shown !== this.shown;
    this.shown = shown;
  }
  receiveRows(i, packet) {
    this.rowsOf[i].add(packet);
    this.isStale.charts = true;
  }
  /// Whether the last packet is drawn.
  get hasShownAll() {
    return !this.isStale.scene && !this.scene.isDirty;
  }
  drawScene() {
    this.isStale.scene = false;
    if (this.snapshot === null) return this.showLegend("none");
    const { head, arrays, parts } = this.snapshot, color = byId("color").value, kind = byId("mesh-kind").value;
    if (arrays.cloud) this.scene.setCloud(arrays.cloud, head.scene.lo, head.scene.hi, color === "distance");
    const shown = parts.map((part, i) => this.placeComponent(i, part.arrays, kind, color));
    this.scene.show({ cloud: isChecked("show-cloud") && Boolean(arrays.cloud), edges: isChecked("show-edges"), split: isChecked("side-by-side"), shown });
    byId("side-labels").hidden = !isChecked("side-by-side");
    const ghost = this.model.simulations[parts[this.front].head.scene.meshes.ghost?.shape[0][0]];
    byId("ghost-name").textContent = ghost && isChecked("show-ghost") ? `Second-best: ${ghost.name}` : "Second-best";
    this.showLegend(color);
    document.documentElement.dataset.frame = head.scene.frame;
    for (const drawn of this.awaiting.splice(0)) drawn();
  }
  /// Receives a packet and waits until it is drawn.
  async present(packet) {
    this.receive(packet);
    this.isStale.charts = true;
    if (this.isStale.scene) await new Promise((drawn) => this.awaiting.push(drawn));
  }
  /// Returns which of its meshes are visible.
  placeComponent(i, arrays, kind, color) {
    const component = this.scene.components[i], mesh = arrays[kind], isShown = this.chooser.isShown(i);
    const shown = { mesh: isShown && isChecked("show-mesh") && Boolean(mesh), ghost: isShown && isChecked("show-ghost") && Boolean(arrays.ghost),
      final: isShown && isChecked("show-final") && Boolean(arrays.final) };
    if (mesh) this.placeMesh(component.mesh, mesh, arrays, kind, color, i);
    for (const part of ["ghost", "final"]) if (shown[part]) component[part].place(arrays[part], arrays[`${part}_eroded`]);
    return shown;
  }
  placeMesh(into, mesh, arrays, kind, color, i) {
    into.place(mesh, arrays[`${kind}_eroded`]);
    const field = this.fields[Number(color.slice(5))], place = field?.places[i];
    const values = arrays[`${kind === "match" ? "match_" : ""}field${place}`];
    if (!values) return into.paintPlain(this.scene.plain);
    const colors = new Uint8Array(values.length * 3);
    paint(values, field.lo, field.hi, colors);
    if (this.models[i].fields[place].location === "node") into.paintNodes(colors);
    else into.paintElements(colors);
  }
  showLegend(color) {
    byId("legend").hidden = color === "none";
    if (color === "none") return;
    const field = this.fields[Number(color.slice(5))];
    const limit = this.snapshot?.head.scene.distance_limit ?? 0;
    const [title, unit, lo, hi] = field && color !== "distance" ? [field.name.replaceAll("_", " "), field.unit, field.lo, field.hi] : ["distance cloud to mesh", this.model.unit, 0, limit];
    byId("legend-title").textContent = unit && unit !== "1" ? `${title} [${unit}]` : title;
    byId("legend-lo").textContent = String(+lo.toPrecision(3));
    byId("legend-hi").textContent = `\u2265 ${+hi.toPrecision(3)}`;
    const context = byId("legend-bar").getContext("2d"), image = context.createImageData(256, 1);
    for (let i = 0; i < 256; ++i) image.data.set([map[i * 3], map[i * 3 + 1], map[i * 3 + 2], 255], i * 4);
    context.putImageData(image, 0, 0);
  }
  /// At most ten times a second: every change of a text makes the browser lay out and paint.
  showWords() {
    this.isStale.words = false;
    this.nextWords = performance.now() + wordsInterval;
    const { parts } = this.snapshot, { health } = this.snapshot.head, { head } = parts[this.front], kind = byId("mesh-kind").value;
    this.verdict.update(head.result, head.test);
    this.chooser.update(parts.map((part) => part.head));
    this.parameters.update(head.result);
    this.forecast.update(head.model_differs ? {} : head.result);
    if (head.test.results > 0) this.channels.update(head.model_differs ? {} : head.result);
    if (health) this.health.update(health, head.test);
    const note = byId("view-note"), text = this.noteOn(head);
    note.hidden = text === "";
    if (note.textContent !== text) note.textContent = text;
    this.offerExports(head.scene.meshes[kind]?.shape);
    if (head.test.results > 0) byId("test-title").textContent = `frame ${head.result.frame}, ${(head.test.seconds * 1000).toFixed(2)} ms`;
    if (health && !health.recording) this.showSource(health);
  }
  /// The part of an address that names the component in front, of several.
  get component() {
    return this.models.length > 1 ? `component=${this.front}&` : "";
  }
  offerExports(shape) {
    byId("save-vtu").setAttribute("aria-disabled", String(!shape));
    if (shape) byId("save-vtu").href = `/export/mesh.vtu?${this.component}shape=${shape.map((share) => share.join(":")).join(",")}`;
    const session = this.model.recording ? `session=${this.snapshot.parts[0].head.test.session}&` : "", query = (this.component + session).slice(0, -1);
    byId("save-csv").href = `/export/curves.csv${query ? `?${query}` : ""}`;
  }
  noteOn(head) {
    if (head.model_differs) return "These results belong to another model than the one of this page; no mesh can be shown.";
    if (head.test.results === 0) return "Waiting for the first frame.";
    if (!this.snapshot.arrays.cloud) return this.snapshot.head.has_preview ? "No measured cloud received yet." : "No cloud: lbea-monitor was started without --frames.";
    return "";
  }
  showSource({ heard_ms }) {
    if (heard_ms === null) this.state("waiting", "Waiting for lbea-serve");
    else if (heard_ms > farFromServer) this.state("lost", `Nothing from lbea-serve for ${Math.floor(heard_ms / 1000)} s`);
    else this.state("live", "Live");
  }
  state(state, text) {
    const element = byId("connection");
    element.dataset.state = state;
    if (element.textContent !== text) element.textContent = text;
  }
  drawCharts() {
    if (!this.isStale.charts || document.hidden) return;
    this.isStale.charts = false;
    const rows = this.rowsOf[this.front], { result, test } = this.snapshot?.parts[this.front].head ?? {}, now = this.model.recording ? test?.seconds : undefined;
    this.probability.update(rows, now);
    this.distance.update(rows, now);
    this.forecastChart.update(rows, now);
    this.channels.draw(rows, now);
    this.plane.update(rows, result?.matches[0]?.simulation ?? -1, now === undefined ? undefined : result.xyz);
  }
  recolor() {
    this.scene.recolor();
    this.plane.recolor();
    this.isStale.scene = this.isStale.charts = true;
  }
  async savePicture() {
    const url = URL.createObjectURL(await this.scene.picture());
    Object.assign(document.createElement("a"), { href: url, download: "view.png" }).click();
    setTimeout(() => URL.revokeObjectURL(url), 10_000);
  }
}

function chooseTheme(dark) {
  document.documentElement.dataset.theme = dark ? "dark" : "light";
  byId("theme").setAttribute("aria-pressed", String(dark));
}

async function start() {
  chooseTheme(matchMedia("(prefers-color-scheme: dark)").matches);
  const { head, parts } = readPacket(await (await fetch("/api/model")).arrayBuffer()), { recording } = head;
  const page = new Page(parts.map((part, i) => ({ ...part.head, name: head.components?.[i], recording, elements: part.arrays.elements, curves: part.arrays.curves })));
  byId("theme").addEventListener("click", () => {
    chooseTheme(document.documentElement.dataset.theme !== "dark");
    page.recolor();
  });
  if (recording) return new Timeline(page, recording);
  connect({
    packet: (packet) => page.receive(packet),
    opened: () => page.state("waiting", "Connected"),
    lost: () => page.state("lost", "No connection to lbea-monitor; trying again"),
  });
}

start().catch((error) => {
  const element = byId("connection");
  element.dataset.state = "lost";
  element.textContent = `The page cannot be shown: ${error.message}`;
});
