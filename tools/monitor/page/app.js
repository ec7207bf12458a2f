// The page: receives messages of the server and shows the latest state.
import { ChannelPanel } from "./channels.js";
import { map, paint } from "./colors.js";
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

class Page {
  constructor(model) {
    this.model = model;
    this.rows = new Rows();
    this.snapshot = null;
    this.isStale = { scene: false, charts: false, words: false };
    this.nextWords = 0;
    this.awaiting = [];
    this.scene = new Scene3d(byId("canvas"), model);
    const nameOf = (simulation) => model.simulations[simulation]?.name ?? `#${simulation}`;
    this.probability = new ProbabilityChart(byId("probability-chart"), byId("probability-list"), nameOf);
    this.distance = new DistanceChart(byId("distance-chart"), byId("distance-title"), model.unit);
    this.forecastChart = new ForecastChart(byId("forecast-chart"), model.unit);
    this.plane = new Plane(byId("plane"), model.curves, model.axes);
    this.verdict = new VerdictPanel(model);
    this.parameters = new ParameterTable(model);
    this.forecast = new ForecastPanel(model);
    this.channels = new ChannelPanel(model.channels, () => (this.isStale.charts = true));
    this.health = new HealthBar();
    this.addColors();
    this.addControls();
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
    const options = this.model.fields.map((field, i) => [`field${i}`, field.name.replaceAll("_", " ")]);
    options.push(["distance", "distance cloud to mesh"], ["none", "uniform"]);
    byId("color").replaceChildren(...options.map(([value, textContent]) => Object.assign(document.createElement("option"), { value, textContent })));
  }
  addControls() {
    for (const id of ["show-cloud", "show-mesh", "show-edges", "show-ghost", "show-final", "side-by-side", "mesh-kind", "color"])
      byId(id).addEventListener("change", () => (this.isStale.scene = this.isStale.words = this.snapshot !== null));
    byId("fit-view").addEventListener("click", () => this.scene.fit());
    byId("save-png").addEventListener("click", () => this.savePicture());
  }
  receive(packet) {
    if (packet.head.type === "rows") {
      this.rows.add(packet);
      this.isStale.charts = true;
    } else if (packet.head.type === "snapshot") {
      this.snapshot = packet;
      this.isStale.words = true;
      // Between frames most snapshots differ only in the ages of the messages.
      const { scene, test } = packet.head, shown = JSON.stringify([test.session, scene, packet.arrays.cloud?.length]);
      this.isStale.scene ||= shown !== this.shown;
      this.shown = shown;
    }
  }
  /// Whether the last packet is drawn.
  get hasShownAll() {
    return !this.isStale.scene && !this.scene.isDirty;
  }
  drawScene() {
    this.isStale.scene = false;
    if (this.snapshot === null) return this.showLegend("none");
    const { head, arrays } = this.snapshot, color = byId("color").value;
    const kind = byId("mesh-kind").value, mesh = arrays[kind];
    if (mesh) this.placeMesh(mesh, arrays, kind, color);
    if (arrays.ghost && isChecked("show-ghost")) this.scene.ghost.place(arrays.ghost, arrays.ghost_eroded);
    if (arrays.final && isChecked("show-final")) this.scene.final.place(arrays.final);
    if (arrays.cloud) this.scene.setCloud(arrays.cloud, head.scene.lo, head.scene.hi, color === "distance");
    this.scene.show({ cloud: isChecked("show-cloud") && Boolean(arrays.cloud), mesh: isChecked("show-mesh") && Boolean(mesh),
      edges: isChecked("show-edges"), ghost: isChecked("show-ghost") && Boolean(arrays.ghost),
      final: isChecked("show-final") && Boolean(arrays.final), split: isChecked("side-by-side") });
    byId("side-labels").hidden = !isChecked("side-by-side");
    const ghost = this.model.simulations[head.scene.meshes.ghost?.shape[0][0]];
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
  placeMesh(mesh, arrays, kind, color) {
    this.scene.mesh.place(mesh, arrays[`${kind}_eroded`]);
    const values = arrays[(kind === "match" ? "match_" : "") + color];
    if (!values) return this.scene.mesh.paintPlain(this.scene.plain);
    const field = this.model.fields[Number(color.slice(5))], colors = new Uint8Array(values.length * 3);
    paint(values, field.lo, field.hi, colors);
    if (field.location === "node") this.scene.mesh.paintNodes(colors);
    else this.scene.mesh.paintElements(colors);
  }
  showLegend(color) {
    byId("legend").hidden = color === "none";
    if (color === "none") return;
    const field = this.model.fields[Number(color.slice(5))];
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
    const { head } = this.snapshot, kind = byId("mesh-kind").value;
    this.verdict.update(head.result, head.test);
    this.parameters.update(head.result);
    this.forecast.update(head.model_differs ? {} : head.result);
    if (head.test.results > 0) this.channels.update(head.model_differs ? {} : head.result);
    if (head.health) this.health.update(head.health, head.test);
    const note = byId("view-note"), text = this.noteOn(head);
    note.hidden = text === "";
    if (note.textContent !== text) note.textContent = text;
    const shape = head.scene.meshes[kind]?.shape;
    byId("save-vtu").setAttribute("aria-disabled", String(!shape));
    if (shape) byId("save-vtu").href = `/export/mesh.vtu?shape=${shape.map((share) => share.join(":")).join(",")}`;
    if (head.test.results > 0) byId("test-title").textContent = `frame ${head.result.frame}, ${(head.test.seconds * 1000).toFixed(2)} ms`;
    if (head.health && !head.health.recording) this.showSource(head.health);
  }
  noteOn(head) {
    if (head.model_differs) return "These results belong to another model than the one of this page; no mesh can be shown.";
    if (head.test.results === 0) return "Waiting for the first frame.";
    if (!this.snapshot.arrays.cloud) return head.has_preview ? "No measured cloud received yet." : "No cloud: lbea-monitor was started without --frames.";
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
    const { result, test } = this.snapshot?.head ?? {}, now = this.model.recording ? test?.seconds : undefined;
    this.probability.update(this.rows, now);
    this.distance.update(this.rows, now);
    this.forecastChart.update(this.rows, now);
    this.channels.draw(this.rows, now);
    this.plane.update(this.rows, result?.matches[0]?.simulation ?? -1, now === undefined ? undefined : result.xyz);
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
  const { head, arrays } = readPacket(await (await fetch("/api/model")).arrayBuffer());
  const page = new Page({ ...head, elements: arrays.elements, curves: arrays.curves });
  byId("theme").addEventListener("click", () => {
    chooseTheme(document.documentElement.dataset.theme !== "dark");
    page.recolor();
  });
  if (head.recording) return new Timeline(page, head.recording);
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
