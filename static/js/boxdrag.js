// While it is on, a plain drag in the 3D frame counts as one with Shift, which draws a box there instead of turning the view.

const TYPES = ["pointerdown", "pointermove", "pointerup"];
const KEPT = ["pointerId", "pointerType", "isPrimary", "pressure", "width", "height", "clientX", "clientY", "screenX", "screenY", "movementX", "movementY", "button", "buttons"];

export class BoxDrag {
  constructor() {
    this.on = false;
  }

  attach(frame) {
    const inside = frame.contentWindow;
    for (const type of TYPES) inside.addEventListener(type, (event) => this.pass(event, inside), true);
  }

  pass(event, inside) {
    if (!this.on || event.shiftKey || !event.isTrusted || event.button > 0) return;
    event.stopImmediatePropagation();
    const copy = Object.fromEntries(KEPT.map((key) => [key, event[key]]));
    event.target.dispatchEvent(new inside.PointerEvent(event.type, { ...copy, shiftKey: true, bubbles: true, cancelable: true, composed: true, view: inside }));
  }
}
