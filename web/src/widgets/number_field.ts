// A field for a number between limits. Anything else is refused, in words, and taken back.
import { h, toast } from "./elements";

export interface Limits {
  min: number;
  max: number;
  step: number;
}

export function numberField(
  label: string,
  value: number,
  { min, max, step }: Limits,
  take: (value: number) => void = () => undefined,
): HTMLInputElement {
  const field = h("input", { type: "number", min, max, step, value, "aria-label": label });
  let last = String(value);
  field.addEventListener("change", () => {
    const { valueAsNumber: typed } = field;
    if (typed >= min && typed <= max) {
      last = field.value;
      return take(typed);
    }
    field.value = last;
    toast(`${label}: a number from ${min} to ${max}.`, "error");
  });
  return field;
}
