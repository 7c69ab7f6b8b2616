/** What models are called beside each other. */

const NUMBER = / \([0-9a-f]{12}\)$/;

/** Labels without the models' numbers, where the names alone tell them apart. */
export function shortLabels(labels: readonly string[]): string[] {
  const short = labels.map((label) => label.replace(NUMBER, ''));
  return new Set(short).size === short.length ? short : [...labels];
}
