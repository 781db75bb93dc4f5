// The state of the page that this browser stores.
export const remember = (key: string, value: string) => {
  try {
    localStorage.setItem(`ruedo.${key}`, value);
  } catch {
    /* private mode */
  }
};
// For one world, and as the default for new ones.
export function rememberFor(world: string, key: string, value: string): void {
  remember(key, value);
  remember(`${key} of ${world}`, value);
}
export const recallFor = (world: string, key: string) =>
  recall(`${key} of ${world}`) ?? recall(key);
export const recall = (key: string) => {
  try {
    return localStorage.getItem(`ruedo.${key}`);
  } catch {
    return null;
  }
};
