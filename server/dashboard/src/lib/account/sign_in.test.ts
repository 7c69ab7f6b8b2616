import { describe, expect, it, vi } from 'vitest';

vi.stubGlobal('sessionStorage', { getItem: () => null });
vi.stubGlobal('location', { origin: 'https://lab', pathname: '/arm/' });
const { roleText } = await import('./sign_in');

describe('signing in', () => {
  it('says what somebody may do at this arm', () => {
    expect(roleText('viewer', false)).toContain('stops');
    expect(roleText('owner', false)).toContain('operator');
    expect(roleText('owner', true)).toContain('everybody');
    expect(roleText('admin', true)).toContain('admin');
  });
});
