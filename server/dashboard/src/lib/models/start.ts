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

/** The request; fields that were left empty are left to the service. */
export function requestOf(kind: StartKind, filled: Filled): JobRequest {
  const parameters = filled.patterns.split(/[\s,]+/).filter((part) => part !== '');
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
