import { describe, expect, it } from 'vitest';
import { METHODS_TO_TRY, withToken } from './settings';

const HERE = 'http://127.0.0.1:8300';
const asked = (url: string) => ({ url, headers: {} as Record<string, string> });

describe('what is tried from the reference of the API', () => {
  it('reads, and changes nothing', () => {
    expect(METHODS_TO_TRY).toEqual(['get']);
  });

  it('carries the token of the tab to this service alone', () => {
    expect(withToken(asked('/api/v1/system'), 'secret', HERE).headers).toEqual({
      Authorization: 'Bearer secret',
    });
    expect(withToken(asked('https://elsewhere.example/'), 'secret', HERE).headers).toEqual({});
    expect(withToken(asked(`${HERE}/api/v1/system`), null, HERE).headers).toEqual({});
  });
});
