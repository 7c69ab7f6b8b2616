/** What a person has filled in, as a request. */

import type { JobRequest } from '../api/types';

export type StartKind = 'fit' | 'validate' | 'compare';

export interface Filled {
  model: string;
  traces: readonly string[];
  held_out: readonly string[];
  name: string;
  /** Patterns of parameters, with commas or spaces between them. */
  patterns: string;
  effects: readonly string[];
  other: string;
}

const parts = (text: string): string[] => text.split(/[\s,]+/).filter((part) => part !== '');

/** Patterns that no parameter of the model matches: a fit would fail for them. Those with brackets are not judged. */
export function unmatched(patterns: string, names: readonly string[]): string[] {
  return parts(patterns).filter((pattern) => {
    if (/[[\]]/.test(pattern)) return false;
    const escaped = pattern
      .replace(/[.+^${}()|\\]/g, '\\$&')
      .replaceAll('*', '.*')
      .replaceAll('?', '.');
    return !names.some((name) => new RegExp(`^${escaped}$`).test(name));
  });
}

/** Whole lines that complete the last pattern of a line. */
export function completedPatterns(line: string, names: readonly string[]): string[] {
  const start = /[^\s,]*$/.exec(line)!.index;
  const begun = line.slice(start);
  return names
    .filter((name) => name.startsWith(begun) && name !== begun)
    .map((name) => line.slice(0, start) + name);
}

/** The request; fields that were left empty are left to the service. */
export function requestOf(kind: StartKind, filled: Filled): JobRequest {
  const parameters = parts(filled.patterns);
  const common = { traces: [...filled.traces] };
  const chosen = parameters.length === 0 ? {} : { parameters };
  switch (kind) {
    case 'fit':
      return {
        kind,
        ...common,
        held_out: [...filled.held_out],
        model: filled.model,
        effects: filled.effects.map((name) => ({ name })),
        ...chosen,
        ...(filled.name.trim() === '' ? {} : { name: filled.name.trim() }),
      } as JobRequest;
    case 'validate':
      return { kind, ...common, model: filled.model, ...chosen } as JobRequest;
    case 'compare':
      return { kind, ...common, models: [...new Set([filled.other, filled.model])] } as JobRequest;
  }
}
