// Which links are drawn plainly, so that many of them do not make every frame slow.
// Triangles of the whole scene: beyond it, round shapes of many links have fewer segments, and
// those far away are boxes
const kBudget = 60_000;
export const kFewLinks = 8; // of a kind, which cost little

// The kinds of links that are drawn plainly, so that the scene keeps to its budget: of each kind,
// triangles of a link and links.
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
