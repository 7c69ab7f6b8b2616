import { describe, expect, it } from 'vitest';
import { rendererOf } from './renderer';

describe('what draws', () => {
  it('is known as the processor by the names of its programs', () => {
    expect(
      rendererOf(
        'ANGLE (Google, Vulkan 1.3.0 (SwiftShader Device (Subzero) (0x0000C0DE)), SwiftShader driver)',
      ),
    ).toBe('processor');
    expect(rendererOf('llvmpipe (LLVM 15.0.6, 256 bits)')).toBe('processor');
    expect(rendererOf('ANGLE (Microsoft, Microsoft Basic Render Driver, D3D11)')).toBe('processor');
    expect(rendererOf('ANGLE (Intel, Mesa Intel(R) UHD Graphics 620 (KBL GT2), OpenGL 4.6)')).toBe('card');
    expect(rendererOf('ANGLE (NVIDIA Corporation, NVIDIA GeForce GTX 1650/PCIe/SSE2, OpenGL 4.5)')).toBe(
      'card',
    );
    expect(rendererOf(null)).toBe('none');
  });
});
