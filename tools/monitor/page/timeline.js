// A recording instead of a running test: a slider over its frames.
import { readPacket } from "./packet.js";

const byId = (id) => document.getElementById(id);
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
  /// The curves of the test that the frame belongs to: a recording may hold several.
  async takeRows(session) {
    this.session = session;
    for (let first = 0; ; first = this.page.rows.count) {
      const answer = await (await fetch(`/api/recording/rows?session=${session}&first=${first}`)).arrayBuffer();
      if (answer.byteLength === 0) return;
      const packet = readPacket(answer);
      packet.head.epoch = session;
      if (packet.arrays.rows.length === 0) return;
      this.page.take(packet);
    }
  }
  async get(address) {
    return readPacket(await (await fetch(address)).arrayBuffer());
  }
  /// One frame at a time, for where the slider is when the last one has been shown.
  async show() {
    const wanted = this.slider.value;
    if (this.isBusy) return;
    this.isBusy = true;
    try {
      const packet = await this.get(`/api/recording/frame?number=${wanted}`);
      await this.page.present(packet);
      if (packet.head.test.session !== this.session) await this.takeRows(packet.head.test.session);
      byId("save-csv").href = `/export/curves.csv?session=${this.session}`;
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
      // Not before the last one was seen: a slow machine plays slowly, and leaves nothing out.
      if (this.isBusy || !this.page.hasShownAll) return;
      this.slider.value = Number(this.slider.value) < Number(this.slider.max) ? Number(this.slider.value) + 1 : 0;
      this.show();
    }, playInterval);
  }
}
