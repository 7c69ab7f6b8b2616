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

const partsOf = (patterns: string): string[] => patterns.split(/[\s,]+/).filter((part) => part !== '');

/** Which of the patterns no parameter has, and what there is instead; empty where all are known. */
export function unknownIn(patterns: string, names: readonly string[]): string {
  const wrong = partsOf(patterns).find((part) => !names.some((name) => matches(part, name)));
  if (wrong === undefined || names.length === 0) return '';
  const head = `${wrong.split('.')[0]}.`;
  const near = names.filter((name) => name.startsWith(head)).slice(0, MOST_NEAR);
  return `no parameter is ${wrong}${near.length > 0 ? `; there are ${near.join(', ')}` : ''}`;
}

/** Lines that the line may become: its last word completed. */
export function namesFor(patterns: string, names: readonly string[]): string[] {
  const last = /[^\s,]*$/.exec(patterns)![0];
  const before = patterns.slice(0, patterns.length - last.length);
  return names.filter((name) => name.startsWith(last)).map((name) => before + name);
}

const MOST_NEAR = 8;

/** Whether a name is that of a pattern, with `*` for anything and `?` for one letter. */
function matches(pattern: string, name: string): boolean {
  // Sets of letters are left to the service.
  if (pattern.includes('[')) return true;
  const escaped = pattern.replace(/[.+^${}()|\]\\]/g, '\\$&');
  return new RegExp(`^${escaped.replaceAll('*', '.*').replaceAll('?', '.')}$`).test(name);
}

/** The request; fields that were left empty are left to the service. */
export function requestOf(kind: StartKind, filled: Filled): JobRequest {
  const parameters = partsOf(filled.patterns);
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
