// A 3D view: the viser page of one session in a frame, steered over REST.
//
//   const view = new View3D(host, { projectId, name: "main" });
//   view.show({ mode: "sequence", tool_id, sequence, step }, "Trough 10 with your order after step 4");
//   view.onPicked((region) => ...);
//   view.onUp((direction) => ...);
//
//   view.show({ mode: "edit", tool_id }, ...)    view.change({ selection: [2, 3] })    view.onEditing((state) => ...)
//   view.onUnder((region) => ...)                what lies under the pointer, while editing
//
// The host is a .stage element; the frame is laid under what else it holds. For screen readers the view is one image with the
// sentence given to `show`; the lists beside it say and do the same. The session id is kept in sessionStorage per project and
// name, so a reload finds its view again. Scenes are sent one at a time and only the latest waiting one, so dragging a slider
// never builds a queue; changes of what is edited are merged until they can go, always after the scene they belong to. The theme goes along as `dark`.

import { get, patch, post, put } from "./api.js";
import { BoxDrag } from "./boxdrag.js";
import { h } from "./dom.js";
import { listen } from "./events.js";
import { adopt } from "./keys.js";
import { isDark } from "./shell.js";
import { complain } from "./toasts.js";
import { Under } from "./under.js";

export class View3D {
  constructor(host, { projectId, name = "main" }) {
    this.projectId = projectId;
    this.slot = `apprentice-view:${projectId}:${name}`;
    this.box = h("div.view3d", { role: "img", "aria-label": "3D view, loading" }, h("div.view3d-wait.skeleton"));
    host.prepend(this.box);
    this.session = null;
    this.wanted = null;
    this.changes = null;
    this.sending = false;
    this.sent = "";
    this.under = null;
    this.drag = new BoxDrag();
    this.ready = this.open().catch((error) => this.fail(error));
    addEventListener("themechange", () => this.scene && this.show(this.scene, this.sentence));
    listen("resync", () => {
      this.sent = "";
      if (this.scene) this.show(this.scene, this.sentence);
    });
  }

  async open() {
    this.session = (await this.find()) ?? (await post("/sessions", { project_id: this.projectId }));
    sessionStorage.setItem(this.slot, this.session.id);
    this.frame = h("iframe", { src: `${this.session.url}?hideViserLogo${isDark() ? "&darkMode" : ""}`, title: "3D view", tabindex: "-1", onload: () => this.loaded() });
    this.box.append(this.frame);
    await this.flush();
  }

  async find() {
    const known = sessionStorage.getItem(this.slot);
    if (!known) return null;
    try {
      return await get(`/sessions/${encodeURIComponent(known)}`);
    } catch (error) {
      if (error.status === 404) return null;
      throw error;
    }
  }

  loaded() {
    adopt(this.frame.contentWindow);
    this.under?.attach(this.frame, this.session.id);
    this.drag.attach(this.frame);
    this.box.querySelector(".view3d-wait")?.remove();
    this.frame.classList.add("shown");
  }

  fail(error) {
    this.box.querySelector(".view3d-wait")?.remove();
    this.box.append(h("p.view3d-fault", { role: "alert" }, `The 3D view cannot be opened. ${error.message} The list beside it still works.`));
  }

  // Shows a scene (see the REST description of sessions) and says it in a sentence.
  show(scene, sentence) {
    if (scene.tool_id !== this.scene?.tool_id || scene.mode !== this.scene?.mode) this.changes = null;
    this.scene = scene;
    this.sentence = sentence;
    this.box.setAttribute("aria-label", sentence);
    this.wanted = { ...scene, dark: isDark() };
    return this.flush();
  }

  async flush() {
    if (this.sending || !this.session) return;
    this.sending = true;
    try {
      while (this.wanted || this.changes) await (this.wanted ? this.sendScene() : this.sendChanges());
    } catch (error) {
      complain(error);
    } finally {
      this.sending = false;
    }
  }

  async sendScene() {
    const scene = this.wanted;
    this.wanted = null;
    const text = JSON.stringify(scene);
    if (text === this.sent) return;
    await put(`/sessions/${encodeURIComponent(this.session.id)}/scene`, scene);
    this.sent = text;
  }

  async sendChanges() {
    const changes = this.changes;
    this.changes = null;
    const session = await patch(`/sessions/${encodeURIComponent(this.session.id)}/scene`, changes);
    if (!this.changes && !this.wanted) this.told?.(session.scene);
  }

  // Mode edit: another selection, way of pointing, points, level or hover.
  change(values) {
    this.changes = { ...this.changes, ...values };
    return this.flush();
  }

  // The state of mode edit after every change of it, from wherever it came; not while a change of ours is on its way.
  onEditing(handler) {
    this.told = handler;
    return listen("session.editing", (state) => state.session_id === this.session?.id && !this.changes && handler(state));
  }

  // Reads that state now, without waiting for the event.
  async tellAgain() {
    if (!this.session || this.changes || this.wanted) return;
    const { scene } = await get(`/sessions/${encodeURIComponent(this.session.id)}`);
    if (scene.mode === "edit" && !this.changes && !this.wanted) this.told?.(scene);
  }

  // A plain drag draws a box around regions instead of turning the view.
  boxing(on) {
    this.drag.on = on;
  }

  onUnder(handler) {
    this.under = new Under(handler);
    if (this.frame?.classList.contains("shown")) this.under.attach(this.frame, this.session.id);
  }

  // Robot playback: action "play", "pause" or "seek".
  control(action, values = {}) {
    return post(`/sessions/${encodeURIComponent(this.session.id)}/playback`, { action, ...values });
  }

  onPicked(handler) {
    return listen("session.picked", ({ session_id: session, region }) => session === this.session?.id && region !== undefined && handler(region));
  }

  // The arrow of a direction beside a file that is being asked about: "+x", ...
  onUp(handler) {
    return listen("session.picked", ({ session_id: session, up }) => session === this.session?.id && up !== undefined && handler(up));
  }
}
