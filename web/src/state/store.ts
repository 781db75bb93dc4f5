// The state of the page, in one place: values are set here, and views watch those that they show.
export class Store<State extends object> {
  private readonly watchers: { keys: (keyof State)[]; call: () => void }[] = [];

  constructor(private readonly values: State) {}

  get now(): Readonly<State> {
    return this.values;
  }

  // Notifies the watchers of values that have changed.
  set(patch: Partial<State>): void {
    const changed = (Object.keys(patch) as (keyof State)[]).filter(
      (key) => !Object.is(patch[key], this.values[key]),
    );
    if (changed.length === 0) return;
    Object.assign(this.values, patch);
    for (const { keys, call } of this.watchers)
      if (keys.some((key) => changed.includes(key))) call();
  }

  // Calls at once, and whenever one of these values changes. Returns what ends that.
  watch(keys: (keyof State)[], call: (state: Readonly<State>) => void): () => void {
    const watcher = { keys, call: () => call(this.values) };
    this.watchers.push(watcher);
    watcher.call();
    return () => this.watchers.splice(this.watchers.indexOf(watcher), 1);
  }
}
