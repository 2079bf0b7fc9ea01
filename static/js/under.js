// Which region lies under the pointer in the 3D frame. The frame is of our own origin, so its pointer can be watched; the
// server casts the ray. One question at a time, at most every 60 ms, none while a button turns the view.

const PAUSE_MS = 60;

export class Under {
  constructor(onRegion) {
    this.onRegion = onRegion;
    this.where = null;
    this.asking = false;
    this.last = null;
  }

  attach(frame, session) {
    this.address = `/v/${encodeURIComponent(session)}/under`;
    const inside = frame.contentWindow;
    inside.addEventListener("pointermove", (event) => {
      if (event.buttons === 0) this.at(event.clientX / inside.innerWidth, event.clientY / inside.innerHeight);
    });
    inside.document.addEventListener("pointerleave", () => this.at(null, null));
    frame.addEventListener("pointerleave", () => this.at(null, null));
  }

  at(x, y) {
    this.where = { x, y };
    if (!this.asking) this.ask();
  }

  async ask() {
    this.asking = true;
    while (this.where) {
      const where = this.where;
      this.where = null;
      const region = await this.lookUp(where);
      if (region !== this.last) this.onRegion(region);
      this.last = region;
      await new Promise((resolve) => setTimeout(resolve, PAUSE_MS));
    }
    this.asking = false;
  }

  // A pointer nobody can look up points at nothing: hovering is a help, never worth a message.
  async lookUp(where) {
    const response = await fetch(this.address, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(where) }).catch(() => null);
    return response?.ok ? ((await response.json()).region ?? null) : null;
  }
}
