// "Ask me about this tool": questions about the one tool whose order the expert doubts, and the order they found.

import { post, remove } from "../api.js";
import { fill, h } from "../dom.js";
import { icon } from "../icons.js";
import { pageAddress } from "../shell.js";
import { complain } from "../toasts.js";
import { number, plural } from "../words.js";

const NOTHING = 1e-9;

// What is said below "Your order for this tool".
export function wantedWords({ answers, probability, extra }) {
  const from = probability === 1 ? `You chose it in ${plural(answers, "answer")}.` : `It fits your ${plural(answers, "answer")} best (probability ${Math.round(100 * probability)} %): check it.`;
  return `${from} ${extra > NOTHING ? `By the policy it costs ${number(extra)} more than the cheapest order.` : "It is one of the policy's cheapest orders."}`;
}

export class Doubt {
  constructor({ projectId, onDropped }) {
    this.projectId = projectId;
    this.onDropped = onDropped;
    this.node = h("div.doubt");
  }

  show(policy, tool, plan) {
    const ask = this.button("Ask me about this tool", "At most three questions; then the order you want counts for this tool alone", async () => {
      await post(`/policies/${encodeURIComponent(policy.id)}/questions`, { tool_id: tool.id });
      location.assign(pageAddress(this.projectId, "teach"));
    });
    const drop = this.button("Back to the policy's order", "Your order for this tool is dropped", async () => {
      await remove(`/tools/${encodeURIComponent(tool.id)}/exception`);
      await this.onDropped();
    });
    fill(this.node, plan.exception ? drop : null, plan.demonstrated ? null : ask);
  }

  button(words, tip, act) {
    const node = h("button.btn.quiet", { type: "button", dataset: { tip }, onclick: async () => {
      node.disabled = true;
      try {
        await act();
      } catch (error) {
        node.disabled = false;
        complain(error);
      }
    } }, icon("info"), words);
    return node;
  }
}
