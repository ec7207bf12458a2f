// The 3D view: measured cloud, matched mesh, and as ghosts the second-best simulation and the end as forecast. It draws only after a
// change.
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { paint, style } from "./colors.js";

const turnStep = 0.12, zoomStep = 1.15;
const slowPicture = 50;  // ms; slower pictures are rendered in software
const plainMesh = { light: 0x9fb2c4, dark: 0x5f7387 };

class Mesh {
  constructor(elements, nodes, ghost) {
    this.elements = elements;
    this.eroded = [];
    const faces = elements.length / 4;
    this.corners = new Uint32Array(faces * 6);
    for (let e = 0; e < faces; ++e) [0, 1, 2, 0, 2, 3].forEach((k, i) => (this.corners[e * 6 + i] = elements[e * 4 + k]));
    this.geometry = new THREE.BufferGeometry();
    this.positions = new THREE.BufferAttribute(new Float32Array(faces * 18), 3);
    this.colors = new THREE.BufferAttribute(new Uint8Array(faces * 18), 3, true);
    this.geometry.setAttribute("position", this.positions);
    this.geometry.setAttribute("color", this.colors);
    this.material = ghost
      ? new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.22, depthWrite: false, side: THREE.DoubleSide })
      : new THREE.MeshLambertMaterial({ vertexColors: true, flatShading: true, side: THREE.DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
    this.surface = new THREE.Mesh(this.geometry, this.material);
    this.edgeGeometry = new THREE.BufferGeometry();
    this.nodes = new THREE.BufferAttribute(new Float32Array(nodes * 3), 3);
    this.edgeGeometry.setAttribute("position", this.nodes);
    this.edgeGeometry.setIndex(new THREE.BufferAttribute(edgesOf(elements, nodes), 1));
    this.edges = new THREE.LineSegments(this.edgeGeometry, new THREE.LineBasicMaterial({ transparent: true, opacity: ghost ? 0.6 : 0.35 }));
    this.group = new THREE.Group().add(this.surface, this.edges);
    this.group.visible = false;
    for (const part of [this.surface, this.edges]) part.frustumCulled = false;
  }
  /// eroded: elements that are not drawn; their corners fall together.
  place(nodes, eroded = []) {
    this.erode(eroded);
    const to = this.positions.array;
    for (let i = 0; i < this.corners.length; ++i) {
      const from = this.corners[i] * 3;
      to[i * 3] = nodes[from];
      to[i * 3 + 1] = nodes[from + 1];
      to[i * 3 + 2] = nodes[from + 2];
    }
    this.nodes.array.set(nodes);
    this.positions.needsUpdate = this.nodes.needsUpdate = true;
  }
  erode(eroded) {
    if (eroded.length === this.eroded.length && eroded.every((e, i) => e === this.eroded[i])) return;
    this.eroded = eroded;
    const gone = new Set(eroded);
    for (let e = 0; e < this.elements.length / 4; ++e)
      [0, 1, 2, 0, 2, 3].forEach((k, i) => (this.corners[e * 6 + i] = this.elements[e * 4 + (gone.has(e) ? 0 : k)]));
    const left = this.elements.filter((_, i) => !gone.has(Math.floor(i / 4)));
    this.edgeGeometry.setIndex(new THREE.BufferAttribute(edgesOf(left, this.nodes.count), 1));
  }
  /// colors: three bytes per element.
  paintElements(colors) {
    const to = this.colors.array;
    for (let i = 0; i < to.length; ++i) to[i] = colors[Math.floor(i / 18) * 3 + (i % 3)];
    this.colors.needsUpdate = true;
  }
  /// colors: three bytes per node.
  paintNodes(colors) {
    const to = this.colors.array;
    for (let i = 0; i < this.corners.length; ++i) for (let c = 0; c < 3; ++c) to[i * 3 + c] = colors[this.corners[i] * 3 + c];
    this.colors.needsUpdate = true;
  }
  paintPlain(color) {
    const rgb = new THREE.Color(color).toArray().map((c) => Math.round(c * 255));
    for (let i = 0; i < this.colors.array.length; ++i) this.colors.array[i] = rgb[i % 3];
    this.colors.needsUpdate = true;
  }
}

function edgesOf(elements, nodes) {
  const seen = new Set(), edges = [];
  for (let e = 0; e < elements.length; e += 4)
    for (let k = 0; k < 4; ++k) {
      const a = elements[e + k], b = elements[e + ((k + 1) % 4)];
      const key = Math.min(a, b) * nodes + Math.max(a, b);
      if (a === b || seen.has(key)) continue;
      seen.add(key);
      edges.push(a, b);
    }
  return new Uint32Array(edges);
}

export class Scene3d {
  /// models: of each component.
  constructor(canvas, models) {
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    // Without conversion, colors are those of the legend.
    THREE.ColorManagement.enabled = false;
    this.renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(35, 1, 1, 100000);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener("change", () => this.draw());
    const headlight = new THREE.DirectionalLight(0xffffff, 1.3);
    this.camera.add(headlight);
    this.scene.add(new THREE.AmbientLight(0xffffff, 2.1), this.camera);
    this.components = models.map(({ elements, nodes }) => ({ mesh: new Mesh(elements, nodes, false), ghost: new Mesh(elements, nodes, true), final: new Mesh(elements, nodes, true) }));
    this.meshes = new THREE.Group().add(...this.components.map(({ mesh }) => mesh.group));
    this.makeCloud();
    this.scene.add(this.meshes, ...this.components.flatMap(({ ghost, final }) => [ghost.group, final.group]), this.points);
    this.lo = new THREE.Vector3(...models[0].lo);
    this.hi = new THREE.Vector3(...models[0].hi);
    for (const { lo, hi } of models) {
      this.lo.min(new THREE.Vector3(...lo));
      this.hi.max(new THREE.Vector3(...hi));
    }
    this.isSplit = false;
    this.isDirty = true;
    this.restUntil = this.renderBegin = 0;
    canvas.addEventListener("keydown", (event) => this.key(event));
    canvas.addEventListener("webglcontextrestored", () => this.restore());
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
    this.recolor();
    this.fit();
    const loop = () => {
      requestAnimationFrame(loop);
      if (this.isDirty && this.isFree()) this.render();
    };
    loop();
  }
  /// Whether the last picture is rendered and, after a slow one, as much time has passed for the rest of the page. Otherwise
  /// pictures would queue up in software rendering, and the page would respond slowly.
  isFree() {
    if (!this.hasDrawn()) return false;
    return performance.now() >= this.restUntil;
  }
  hasDrawn() {
    if (!this.fence) return true;
    const gl = this.renderer.getContext();
    if (!gl.isContextLost() && gl.getSyncParameter(this.fence, gl.SYNC_STATUS) !== gl.SIGNALED) return false;
    gl.deleteSync(this.fence);
    this.fence = null;
    const took = performance.now() - this.renderBegin;
    if (took > slowPicture) this.restUntil = performance.now() + took;
    return true;
  }
  makeCloud() {
    this.cloudGeometry = new THREE.BufferGeometry();
    this.points = new THREE.Points(this.cloudGeometry, new THREE.PointsMaterial({ size: 2, sizeAttenuation: false, vertexColors: true }));
    this.points.frustumCulled = false;
    this.points.visible = false;
    this.reserveCloud(20000);
  }
  reserveCloud(count) {
    this.capacity = count;
    this.cloudPositions = new THREE.BufferAttribute(new Float32Array(count * 3), 3);
    this.cloudColors = new THREE.BufferAttribute(new Uint8Array(count * 3), 3, true);
    this.cloudGeometry.setAttribute("position", this.cloudPositions);
    this.cloudGeometry.setAttribute("color", this.cloudColors);
  }
  /// values: x, y, z in the box lo..hi, and the distance, as shares of 65535. byDistance: colors show the distance.
  setCloud(values, lo, hi, byDistance) {
    const count = values.length / 4;
    if (count > this.capacity) this.reserveCloud(count * 2);
    const to = this.cloudPositions.array;
    for (let i = 0; i < count; ++i)
      for (let k = 0; k < 3; ++k) to[i * 3 + k] = lo[k] + (values[i * 4 + k] / 65535) * (hi[k] - lo[k]);
    if (byDistance) {
      const distances = new Uint16Array(count);
      for (let i = 0; i < count; ++i) distances[i] = values[i * 4 + 3];
      paint(distances, 0, 65535, this.cloudColors.array);
    } else {
      const rgb = new THREE.Color(style("--mark")).toArray().map((c) => Math.round(c * 255));
      for (let i = 0; i < count * 3; ++i) this.cloudColors.array[i] = rgb[i % 3];
    }
    this.cloudGeometry.setDrawRange(0, count);
    this.cloudPositions.needsUpdate = this.cloudColors.needsUpdate = true;
    this.draw();
  }
  /// shown: what is visible of each component.
  show({ cloud, edges, split, shown }) {
    const refits = split !== this.isSplit;
    this.points.visible = cloud;
    shown.forEach((visible, i) => {
      const component = this.components[i];
      for (const part of ["mesh", "ghost", "final"]) component[part].group.visible = visible[part];
      component.mesh.edges.visible = edges;
    });
    this.isSplit = split;
    if (refits) this.fit();
    this.draw();
  }
  recolor() {
    const dark = document.documentElement.dataset.theme === "dark";
    this.renderer.setClearColor(style("--stage"));
    for (const { mesh, ghost, final } of this.components) {
      mesh.edges.material.color.set(dark ? "#dfe7ef" : "#10161c");
      for (const part of [ghost.surface, ghost.edges]) part.material.color.set(style("--ghost"));
      for (const part of [final.surface, final.edges]) part.material.color.set(style("--final"));
    }
    this.plain = dark ? plainMesh.dark : plainMesh.light;
    this.draw();
  }
  /// Moves the camera as close as all corners of the box of the simulations stay visible.
  fit() {
    const center = this.lo.clone().add(this.hi).multiplyScalar(0.5), toCamera = new THREE.Vector3(0.55, -0.9, 0.5).normalize();
    const right = new THREE.Vector3().crossVectors(this.camera.up, toCamera).normalize(), up = new THREE.Vector3().crossVectors(toCamera, right);
    const aspect = (this.canvas.clientWidth / this.canvas.clientHeight) * (this.isSplit ? 0.5 : 1);
    const vertical = Math.tan(THREE.MathUtils.degToRad(this.camera.fov / 2)), horizontal = vertical * aspect;
    let away = 0;
    for (let corner = 0; corner < 8; ++corner) {
      const at = new THREE.Vector3(...[0, 1, 2].map((k) => ((corner >> k) & 1 ? this.hi : this.lo).getComponent(k))).sub(center);
      away = Math.max(away, at.dot(toCamera) + Math.max(Math.abs(at.dot(right)) / horizontal, Math.abs(at.dot(up)) / vertical));
    }
    away *= 1.04;
    this.controls.target.copy(center);
    this.camera.position.copy(center).addScaledVector(toCamera, away);
    this.camera.near = away / 100;
    this.camera.far = away * 20;
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.draw();
  }
  key(event) {
    const offset = this.camera.position.clone().sub(this.controls.target);
    const turns = { ArrowLeft: [-turnStep, 0], ArrowRight: [turnStep, 0], ArrowUp: [0, -turnStep], ArrowDown: [0, turnStep] };
    const zooms = { "+": 1 / zoomStep, "=": 1 / zoomStep, "-": zoomStep };
    if (event.key in turns) {
      const [along, up] = turns[event.key];
      offset.applyAxisAngle(this.camera.up, along);
      const side = new THREE.Vector3().crossVectors(this.camera.up, offset).normalize();
      const turned = offset.clone().applyAxisAngle(side, up);
      if (turned.clone().cross(this.camera.up).length() > 0.05 * turned.length()) offset.copy(turned);
    } else if (event.key in zooms) offset.multiplyScalar(zooms[event.key]);
    else if (event.key === "f" || event.key === "F") return this.fit();
    else return;
    event.preventDefault();
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.draw();
  }
  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    if (width === 0 || height === 0) return;
    // Two million pixels are enough on a 4K screen.
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2, Math.max(0.5, Math.sqrt(2.2e6 / (width * height)))));
    this.renderer.setSize(width, height, false);
    this.points.material.size = Math.max(1.5, height / 420) * this.renderer.getPixelRatio();
    this.draw();
    if (this.fence !== undefined && this.hasDrawn()) this.render();  // resizing clears the picture, so draw without a pause
  }
  draw() {
    this.isDirty = true;
  }
  /// After a crash of the graphics driver or a suspend, the pending picture is lost.
  restore() {
    this.fence = null;
    this.recolor();
  }
  render() {
    this.isDirty = false;
    this.renderBegin = performance.now();
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    this.renderer.setScissorTest(this.isSplit);
    if (this.isSplit) {
      this.renderPart(0, width / 2, height, this.points.visible, false);
      this.renderPart(width / 2, width / 2, height, false, this.meshes.visible);
    } else this.renderPart(0, width, height, this.points.visible, this.meshes.visible);
    const gl = this.renderer.getContext();
    this.fence ??= gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
  }
  renderPart(left, width, height, cloud, mesh) {
    const shown = [this.points.visible, this.meshes.visible];
    [this.points.visible, this.meshes.visible] = [cloud, mesh];
    this.renderer.setViewport(left, 0, width, height);
    this.renderer.setScissor(left, 0, width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.renderer.render(this.scene, this.camera);
    [this.points.visible, this.meshes.visible] = shown;
  }
  picture() {
    this.render();
    return new Promise((done) => this.canvas.toBlob(done, "image/png"));
  }
}
