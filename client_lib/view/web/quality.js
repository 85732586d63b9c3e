// How well a picture is drawn. In full, as long as that is fast. Where full pictures are measured to be slow, as where the
// processor draws, those that follow each other are drafts, without multisampling, and the last one is drawn in full once it
// stands: as ParaView's interactive and still render, and xeokit's FastNavPlugin.
import * as THREE from 'three';

export const SLOW = 50;     // ms, of the median of so many pictures
const OFTEN = 5;
const FAST = 12;     // ms; drafts that are done by then do not need to be drafts
const PERIOD = 500;  // ms between two measurements, which keep the page waiting
const SAMPLES = 4;   // of a pixel, as browsers have them

const median = (values) => values.toSorted((a, b) => a - b)[values.length >> 1];

// Whether there is no graphics card.
export function drawnByProcessor() {
  const gl = document.createElement('canvas').getContext('webgl2'), info = gl?.getExtension('WEBGL_debug_renderer_info'), found = info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : '';
  gl?.getExtension('WEBGL_lose_context')?.loseContext();
  return /swiftshader|llvmpipe|software/i.test(found);
}

export class Measured {
  constructor() { Object.assign(this, {slow: false, times: {full: [], draft: []}}); }

  // Of a full picture or a draft, ms.
  take(kind, time) {
    const times = this.times[kind];
    times.push(time);
    if (times.length > OFTEN) times.shift();
    if (times.length < OFTEN) return;
    if (kind === 'full') this.slow = median(times) > SLOW;
    else if (median(times) < FAST) Object.assign(this, {slow: false, times: {full: [], draft: []}});
  }
}

export class Quality extends Measured {
  // Pictures of the one kind are drawn on the canvas, which is multisampled or not, those of the other on a sheet in front of it.
  constructor(renderer) {
    super();
    Object.assign(this, {renderer, measured: -Infinity, pixel: new Uint8Array(4), sampled: renderer.getContext().getContextAttributes().antialias});
    this.target = new THREE.WebGLRenderTarget(1, 1, {samples: this.sampled ? 0 : SAMPLES, resolveDepthBuffer: false, internalFormat: 'RGBA8', colorSpace: THREE.SRGBColorSpace, minFilter: THREE.NearestFilter, magFilter: THREE.NearestFilter});
    this.target.isXRRenderTarget = true;  // colours of a screen, and blended as on one
    const material = new THREE.ShaderMaterial({
      vertexShader: 'varying vec2 at; void main() { at = uv; gl_Position = vec4(position.xy, 0.0, 1.0); }',
      fragmentShader: 'uniform sampler2D drawn; varying vec2 at; void main() { gl_FragColor = texture2D(drawn, at); }',
      uniforms: {drawn: {value: this.target.texture}}, depthTest: false, depthWrite: false,
    });
    this.sheet = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), material);
    this.sheet.frustumCulled = false;
    this.one = new THREE.Camera();
  }

  draw(scene, camera, full) {
    const {renderer} = this, {memory, programs} = renderer.info, known = () => `${programs.length} ${memory.geometries} ${memory.textures}`, before = known();
    const due = this.times[full ? 'full' : 'draft'].length < OFTEN || performance.now() - this.measured > PERIOD;
    if (due) this.wait();
    const began = performance.now();
    if (full === this.sampled) renderer.render(scene, camera);
    else this.copy(scene, camera);
    if (!due) return;
    this.wait();
    if (known() !== before) return;  // one that has something new takes longer
    this.measured = performance.now();
    this.take(full ? 'full' : 'draft', this.measured - began);
  }

  copy(scene, camera) {
    const {renderer, target} = this, {width, height} = renderer.domElement, gl = renderer.getContext();
    target.setSize(Math.max(width, 1), Math.max(height, 1));
    renderer.setRenderTarget(target);
    renderer.render(scene, camera);
    renderer.setRenderTarget(null);
    if (this.sampled) { renderer.render(this.sheet, this.one); return; }
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, renderer.properties.get(target).__webglFramebuffer);
    gl.blitFramebuffer(0, 0, width, height, 0, 0, width, height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, null);
  }

  // Until all that was asked for is drawn.
  wait() {
    const gl = this.renderer.getContext();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, this.pixel);
  }
}
