// The meaning of pixels in label pictures: bodies, or models of a class.
import type { device_info_t } from "../../generated/messages";
import type { PageState } from "./page";

const kMostNames = 3; // of a class

// Where the pictures of a device come from. Names begin with the label itself.
export function pictureSource(
  { world, scene }: Pick<PageState, "world" | "scene">,
  device: device_info_t | undefined,
): { kind: string; nameOf: (label: number) => string } {
  const ofClass = (label: number): string[] =>
    (scene?.classes ?? []).filter(([each]) => each === label).flatMap(([, ...models]) => models);
  const kind = device?.kind ?? "";
  const nameOf = (label: number) => {
    if (kind !== "segmentation_camera") return words(`${label}`, [world?.bodies[label - 1]?.name]);
    // 256 times the class plus the number of the model in it
    const number = label & 255;
    return label < 256
      ? words(`${label}`, ofClass(label))
      : words(`${label >> 8} #${number}`, [ofClass(label >> 8)[number - 1]]);
  };
  return { kind, nameOf };
}

function words(label: string, names: (string | undefined)[]): string {
  const known = names.filter((name) => name !== undefined),
    more = known.length > kMostNames ? " …" : "";
  return [label, known.slice(0, kMostNames).join(", ") + more].filter(Boolean).join(" ");
}
