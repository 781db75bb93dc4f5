// Which links are drawn plainly, so that many of them do not slow down every frame.

// Triangles of the whole scene. Beyond this, round shapes of numerous links have fewer segments,
// and distant ones are boxes
const kBudget = 60_000;
export const kFewLinks = 8; // of one kind: these cost little

// The kinds of links to draw plainly so that the scene keeps to its budget. Given for each kind:
// triangles of one link, and the number of links.
export function plainKinds(triangles: number[], links: number[]): Set<number> {
  const cost = triangles.map((each, kind) => each * links[kind]!),
    plain = new Set<number>();
  let all = cost.reduce((sum, each) => sum + each, 0);
  for (const kind of cost.map((_, i) => i).sort((a, b) => cost[b]! - cost[a]!)) {
    if (all <= kBudget) break;
    if (links[kind]! <= kFewLinks) continue;
    plain.add(kind);
    all -= cost[kind]!;
  }
  return plain;
}
