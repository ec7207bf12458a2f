// The timeline of a recording: a slider over its frames.
import { readPacket } from "./connection.js";
import { byId } from "./panels.js";

const playInterval = 100;  // ms

export class Timeline {
  constructor(page, recording) {
    this.page = page;
    this.slider = byId("scrub");
    this.slider.max = Math.max(0, recording.frames - 1);
    byId("timeline").hidden = false;
    this.slider.addEventListener("input", () => this.show());
    byId("play").addEventListener("click", () => this.play(byId("play").getAttribute("aria-pressed") !== "true"));
    this.page.state("live", `Recording ${recording.file}: ${recording.words === "complete" ? "this recording is complete" : recording.words}`);
    this.show();
  }
  /// Loads the curves of the test that the frame belongs to; a recording may contain several tests.
  async loadRows(session) {
    this.session = session;
    for (let i = 0; i < this.page.models.length; ++i) await this.loadRowsOf(i, session);
  }
  async loadRowsOf(i, session) {
    for (let first = 0; ; first = this.page.rowsOf[i].count) {
      const answer = await (await fetch(`/api/recording/rows?session=${session}&first=${first}&component=${i}`)).arrayBuffer();
      if (answer.byteLength === 0) return;
      const packet = readPacket(answer);
      packet.head.epoch = session;
      if (packet.arrays.rows.length === 0) return;
      this.page.receiveRows(i, packet);
    }
  }
  async get(address) {
    return readPacket(await (await fetch(address)).arrayBuffer());
  }
  /// Loads and shows one frame at a time; then continues if the slider has moved.
  async show() {
    const wanted = this.slider.value;
    if (this.isBusy) return;
    this.isBusy = true;
    try {
      const packet = await this.get(`/api/recording/frame?number=${wanted}`);
      await this.page.present(packet);
      const { session } = packet.parts[0].head.test;
      if (session !== this.session) await this.loadRows(session);
      byId("scrub-at").textContent = `${Number(wanted) + 1} of ${Number(this.slider.max) + 1}`;
    } finally {
      this.isBusy = false;
    }
    if (this.slider.value !== wanted) this.show();
  }
  play(on) {
    byId("play").setAttribute("aria-pressed", String(on));
    clearInterval(this.timer);
    if (!on) return;
    this.timer = setInterval(() => {
      // Waits until the last frame is drawn: a slow machine plays slowly, but shows every frame.
      if (this.isBusy || !this.page.hasShownAll) return;
      this.slider.value = Number(this.slider.value) < Number(this.slider.max) ? Number(this.slider.value) + 1 : 0;
      this.show();
    }, playInterval);
  }
}
