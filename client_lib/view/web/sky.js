// Light of the sky that does not reach everything: below a table, in a box, beside a Part it is darker. A picture of the cell from
// above has the heights; their mean and variance around each point give the share of its surroundings that is higher than it
// (Chebyshev's inequality, exact for two heights: Donnelly, Lauritzen 2006, "Variance shadow maps"), which keeps that much of
// the light away. One look into a picture for each pixel, and the picture is made again as seldom as the shadows.
import * as THREE from 'three';

const SIZE = {hard: 512, soft: 128}, COARSE = 32;  // pixels of the heights, and of their surroundings
export const LAYER = 1;  // of things that keep light of the sky away
const WOVEN = 400, WOVEN_LAYER = 2;  // pixels of the picture of a floor
const WALLS = '3.0';   // a thin wall keeps away more than its share of the ground
const STRENGTH = 0.6;  // share of the light of the sky that a point in a closed box is without
const BESIDE = 0.035;  // m; walls have the sky of the points at this distance in front of them
const FAR = 0.07, NEAR = 0.015;  // m between two heights that are compared: surroundings of 0.3 m and of 0.03 m
const ABOVE = 0.004;   // m; a surface does not cover itself

const HEIGHTS = {
  vertexShader: `uniform float low; varying float h;
    void main() { vec4 at = modelMatrix * vec4(position, 1.0); h = at.z - low; gl_Position = projectionMatrix * viewMatrix * at; }`,
  fragmentShader: 'varying float h; void main() { gl_FragColor = vec4(h, h * h, 0.0, 1.0); }',
};
const WHOLE = 'varying vec2 at; void main() { at = uv; gl_Position = vec4(position.xy, 0.0, 1.0); }';
// Weighted by a bell curve, `width` (of the picture) between its points; with the wide surroundings beside the near ones.
const blur = (half, beside) => ({
  vertexShader: WHOLE,
  fragmentShader: `uniform sampler2D from${beside ? ', coarse' : ''}; uniform float width; varying vec2 at;
    void main() {
      vec2 sum = vec2(0.0); float all = 0.0;
      for (int i = -${half}; i <= ${half}; ++i) for (int k = -${half}; k <= ${half}; ++k) {
        vec2 of = texture2D(from, at + width * vec2(i, k)).rg;
        float weight = exp(-float(i * i + k * k) / ${(half * half / 2).toFixed(1)})${beside ? '' : ` * (1.0 + ${WALLS} * smoothstep(0.0, 0.3, of.x))`};
        sum += weight * of; all += weight;
      }
      gl_FragColor = vec4(sum / all, ${beside ? 'texture2D(coarse, at).rg' : '0.0, 1.0'});
    }`,
});

export class Sky {
  constructor(renderer, soft) {
    const gl = renderer.getContext(), size = soft ? SIZE.soft : SIZE.hard;
    // Squares of heights need all digits.
    this.works = Boolean(gl.getExtension('EXT_color_buffer_float') && gl.getExtension('OES_texture_float_linear'));
    this.uniforms = {skyMap: {value: null}, skyFrom: {value: new THREE.Vector4(0, 0, 1, 1)}, skyStrength: {value: 0}};
    if (!this.works) return;
    const target = (pixels, format, mips) => new THREE.WebGLRenderTarget(pixels, pixels, {type: THREE.FloatType, format, depthBuffer: mips, generateMipmaps: mips, minFilter: mips ? THREE.LinearMipmapLinearFilter : THREE.LinearFilter});
    Object.assign(this, {renderer, heights: target(size, THREE.RGBAFormat, true), coarse: target(COARSE, THREE.RGBAFormat, false), map: target(size, THREE.RGBAFormat, false)});
    this.camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0, 1);
    this.height = new THREE.ShaderMaterial({...HEIGHTS, side: THREE.DoubleSide, uniforms: {low: {value: 0}}});
    const pass = (half, beside) => new THREE.ShaderMaterial({...blur(half, beside), depthTest: false, depthWrite: false, uniforms: {from: {value: this.heights.texture}, coarse: {value: this.coarse.texture}, width: {value: 0}}});
    Object.assign(this, {far: pass(4, false), near: pass(2, true), square: new THREE.Mesh(new THREE.PlaneGeometry(2, 2)), one: new THREE.Camera()});
    this.square.frustumCulled = false;
    this.uniforms.skyMap.value = this.map.texture;
  }

  // The material has less of the light of the sky where it is covered.
  shade(material) {
    if (this.works) material.onBeforeCompile = (shader) => {
      Object.assign(shader.uniforms, this.uniforms);
      shader.vertexShader = shader.vertexShader.replace('void main() {', 'uniform vec4 skyFrom; varying vec3 vSky;\nvoid main() {')
        .replace('#include <project_vertex>', `#include <project_vertex>
          vec3 skyAt = (modelMatrix * vec4(transformed, 1.0)).xyz, skyTo = mat3(modelMatrix) * objectNormal;
          vSky = vec3((skyAt.xy + ${BESIDE} * normalize(skyTo + vec3(0.0, 0.0, 1e-9)).xy - skyFrom.xy) / skyFrom.w + 0.5, skyAt.z + ${ABOVE} - skyFrom.z);`);
      shader.fragmentShader = shader.fragmentShader.replace('void main() {', `uniform sampler2D skyMap; uniform float skyStrength; varying vec3 vSky;
          float skyOpen(vec2 of) { float over = of.x - vSky.z, spread = max(of.y - of.x * of.x, 0.0) + 1e-5; return over > 0.0 ? spread / (spread + over * over) : 1.0; }
          float sky() { vec4 of = texture2D(skyMap, vSky.xy); return 1.0 - skyStrength * (1.0 - 0.5 * (skyOpen(of.xy) + skyOpen(of.zw))); }
          void main() {`)
        .replace('#include <aomap_fragment>', 'reflectedLight.indirectDiffuse *= sky();')
        .replace('gl_FragColor = vec4( color, opacity * ( 1.0 - getShadowMask() ) );', 'gl_FragColor = vec4( color, 1.0 - ( 1.0 - opacity * ( 1.0 - getShadowMask() ) ) * sky() );');
    };
    return material;
  }

  // From above, around the middle: the heights of what is in `world`, m above `low`.
  look(scene, {middle, radius, low}, whole) {
    const {uniforms, camera, renderer, square} = this;
    uniforms.skyStrength.value = this.works && whole ? STRENGTH : 0;
    if (!this.works) return;
    const half = 1.1 * radius, tall = Math.max(middle.z - low + radius, 0.1);
    Object.assign(camera, {left: -half, right: half, top: half, bottom: -half, far: tall + 2});
    camera.position.set(middle.x, middle.y, low + tall + 1);
    camera.rotation.set(0, 0, 0);
    camera.layers.set(LAYER);
    camera.updateProjectionMatrix();
    uniforms.skyFrom.value.set(middle.x, middle.y, low, 2 * half);
    this.height.uniforms.low.value = low;
    const {background} = scene, color = renderer.getClearColor(new THREE.Color()), alpha = renderer.getClearAlpha();
    Object.assign(scene, {background: null, overrideMaterial: this.height});
    renderer.setClearColor(0, 0);
    renderer.setRenderTarget(this.heights);
    renderer.render(scene, camera);
    Object.assign(scene, {background, overrideMaterial: null});
    for (const [pass, target, step] of [[this.far, this.coarse, FAR], [this.near, this.map, NEAR]]) {
      pass.uniforms.width.value = Math.max(step / (2 * half), 1 / target.width);
      square.material = pass;
      renderer.setRenderTarget(target);
      renderer.render(square, this.one);
    }
    renderer.setRenderTarget(null);
    renderer.setClearColor(color, alpha);
  }
}

// The floor as a picture of its shadows: where the processor draws, most of a frame is floor, and its shadows are drawn seldom.
export class Carpet {
  // `floor` is drawn into it alone, in the light of `lights`.
  constructor(floor, lights) {
    this.floor = floor;
    this.picture = new THREE.WebGLRenderTarget(WOVEN, WOVEN, {depthBuffer: false});
    this.mesh = new THREE.Mesh(floor.geometry, new THREE.MeshBasicMaterial({map: this.picture.texture, transparent: true, depthWrite: false, toneMapped: false}));
    this.mesh.renderOrder = floor.renderOrder;
    floor.material.blending = THREE.NoBlending;
    floor.layers.set(WOVEN_LAYER);
    for (const light of lights) light.layers.enable(WOVEN_LAYER);
    // Just above the floor: what stands on it is behind this camera, and casts its shadow all the same.
    this.camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0, 0.001);
    for (const layer of [LAYER, WOVEN_LAYER]) this.camera.layers.enable(layer);
    this.camera.layers.disable(0);
  }

  weave(renderer, scene) {
    const {floor, mesh} = this, {background} = scene, color = renderer.getClearColor(new THREE.Color()), alpha = renderer.getClearAlpha();
    const half = floor.scale.x / 2;
    mesh.scale.copy(floor.scale);
    mesh.position.copy(floor.position);
    Object.assign(this.camera, {left: -half, right: half, top: half, bottom: -half});
    this.camera.position.copy(floor.position).z += 0.0005;
    this.camera.updateProjectionMatrix();
    scene.background = null;
    renderer.setClearColor(0, 0);
    renderer.setRenderTarget(this.picture);
    renderer.render(scene, this.camera);
    renderer.setRenderTarget(null);
    renderer.setClearColor(color, alpha);
    scene.background = background;
  }
}
