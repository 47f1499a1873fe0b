#version 330
// Linear light from many lamps with shadow maps in one atlas of 4 x 4 tiles. PERSON: skin, hair and clothes; key lamps also shine.
in vec3 position;
in vec3 normal;
in vec2 coordinate;
in float part;
out vec4 colour;

uniform sampler2D albedo_map;
uniform sampler2D normal_map;
uniform sampler2D skin_mask;
uniform sampler2DShadow shadow_map;
uniform int lamps;
uniform int key_lamps;
uniform vec3 lamp_position[16];
uniform vec3 lamp_colour[16];
uniform mat4 lamp_matrix[16];
uniform float lamp_softness[16];
uniform float lamp_reach2[16];
uniform vec3 camera;
uniform vec3 ambient_up;
uniform vec3 ambient_down;
uniform vec3 tint;
uniform float roughness_of_surface;
uniform float gloss_of_surface;
uniform vec3 emission;
uniform vec2 jitter;
uniform vec3 skin_tint;
uniform vec3 hair_tint;
uniform vec3 clothes_tint;

// Interleaved gradient noise: the soft shadow's taps turn from pixel to pixel, and several passes with other jitter average it.
float noise(vec2 at) { return fract(52.9829189 * fract(dot(at, vec2(0.06711056, 0.00583715)))); }

// An approximation of the sRGB curve.
vec3 linear(vec3 c) { return c * (c * (c * 0.3053 + 0.6822) + 0.0125); }

float lit(int lamp, vec4 at, vec2 turn, float taps) {
  vec4 clip = lamp_matrix[lamp] * at;
  vec3 place = clip.xyz / clip.w;
  bool inside = clip.w > 0.0 && max(abs(place.x), abs(place.y)) < 0.985 && abs(place.z) < 1.0;
  if (!inside) return 1.0;
  place = clamp(place * 0.5 + 0.5, 0.012, 0.988);
  vec2 tile = vec2(float(lamp & 3), float(lamp >> 2)) * 0.25;
  vec2 offset = turn * lamp_softness[lamp];
  float depth = place.z - 0.0015;
  float first = texture(shadow_map, vec3(tile + clamp(place.xy + offset, 0.01, 0.99) * 0.25, depth));
  if (taps < 1.5) return first;
  return 0.5 * (first + texture(shadow_map, vec3(tile + clamp(place.xy - offset * 0.7, 0.01, 0.99) * 0.25, depth)));
}

void main() {
  vec3 albedo = linear(texture(albedo_map, coordinate).rgb) * tint;
  vec3 to_camera = normalize(camera - position);
  vec3 flat_normal = normalize(normal);
  vec3 n = flat_normal;
  float roughness = roughness_of_surface;
  float gloss = gloss_of_surface;
  float skin = 0.0;
#ifdef PERSON
  bool hand = part > 2.5 && part < 4.5;
  bool eye = part > 90.0;
  skin = texture(skin_mask, coordinate).r;
  if (hand) skin = max(skin, 0.9);
  if (part > 6.5) skin = 0.0;
  vec3 other = part < 1.5 ? hair_tint : clothes_tint;
  albedo *= mix(other, skin_tint, skin);
  roughness = mix(0.75, 0.47, skin);
  gloss = mix(0.25, 0.8, skin);
  if (eye) { roughness = 0.12; gloss = 1.6; albedo = linear(texture(albedo_map, coordinate).rgb) * 0.8; skin = 0.0; }
  if (dot(flat_normal, to_camera) < 0.0) flat_normal = -flat_normal;
  // Tangents from screen-space derivatives: the packed avatars carry none.
  vec3 dpx = dFdx(position), dpy = dFdy(position);
  vec2 dux = dFdx(coordinate), duy = dFdy(coordinate);
  vec3 py = cross(dpy, flat_normal), px = cross(flat_normal, dpx);
  vec3 t = py * dux.x + px * duy.x, b = py * dux.y + px * duy.y;
  float scale = inversesqrt(max(max(dot(t, t), dot(b, b)), 1e-20));
  vec3 bump = texture(normal_map, coordinate).xyz * 2.0 - 1.0;
  bump.xy *= 0.8;
  n = normalize(t * scale * bump.x - b * scale * bump.y + flat_normal * max(bump.z, 0.2));
#endif
  float angle = noise(gl_FragCoord.xy + jitter) * 6.2831853;
  vec2 turn = vec2(cos(angle), sin(angle));
  vec4 raised = vec4(position + flat_normal * 0.012, 1.0);
  float facing = max(dot(n, to_camera), 0.05);
  float a2 = roughness * roughness * roughness * roughness;
  float k = roughness * roughness * 0.5;
  // Light wraps around skin, red most: it scatters under the surface.
  vec3 wrap = vec3(0.28, 0.10, 0.06) * skin;
  vec3 scale_wrap = 1.0 / ((1.0 + wrap) * (1.0 + wrap));
  vec3 mixed = mix(vec3(1.0), vec3(0.35, 0.75, 1.0), skin);
  vec3 diffuse = vec3(0.0), shine = vec3(0.0);
  float seen = 0.0;
  for (int i = 0; i < lamps; i++) {
    vec3 l = lamp_position[i] - position;
    float d2 = dot(l, l);
    l *= inversesqrt(d2);
    bool key = i < key_lamps;
    float s = lit(i, raised, turn, key ? 2.0 : 1.0);
    seen += s;
    vec3 light = lamp_colour[i] * (key ? min(lamp_reach2[i] / d2, 3.0) : 1.0);
    float nl = dot(n, l);
    vec3 cosine = mix(vec3(dot(flat_normal, l)), vec3(nl), mixed);
    float edge = s * (1.0 - s) * skin;
    diffuse += light * clamp((cosine + wrap) * scale_wrap, 0.0, 1.0) * vec3(s + 0.3 * edge, s, s - 0.08 * edge);
    if (!key) continue;
    vec3 h = normalize(l + to_camera);
    float nh = max(dot(n, h), 0.0);
    float spread = nh * nh * (a2 - 1.0) + 1.0;
    float grazing = 1.0 - max(dot(to_camera, h), 0.0);
    float fresnel = 0.028 + 0.97 * grazing * grazing * grazing * grazing * grazing;
    nl = max(nl, 0.0);
    float lobe = a2 * fresnel / (12.566 * spread * spread * (nl * (1.0 - k) + k + 1e-3) * (facing * (1.0 - k) + k));
    shine += light * (s * nl * gloss * min(lobe, 4.0));
  }
  seen /= float(max(lamps, 1));
  vec3 ambient = mix(ambient_down, ambient_up, n.y * 0.5 + 0.5) * (0.35 + 0.65 * seen);
  float rim = 1.0 - max(dot(n, to_camera), 0.0);
  rim *= rim;
  rim *= rim;
  vec3 sum = albedo * (diffuse + ambient) + shine * 0.9 + ambient * rim * 0.10 * gloss + emission;
  colour = vec4(clamp(sum, vec3(0.0), vec3(60.0)), 1.0);
}
