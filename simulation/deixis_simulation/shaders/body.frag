#version 330
// What a person is made of, pixel by pixel; the light falls on it afterwards (person.frag). Avatars have many triangles smaller than
// a pixel, and a software renderer shades a block of pixels for each: lighting them here took three times as long.
in vec3 position;
in vec3 normal;
in vec2 coordinate;
in float part;
layout(location = 0) out vec4 out_albedo;
layout(location = 1) out vec4 out_normal;
layout(location = 2) out vec4 out_flat;
layout(location = 3) out vec4 out_position;
uniform sampler2D albedo_map;
uniform sampler2D normal_map;
uniform sampler2D skin_mask;
uniform vec3 camera;
uniform vec3 skin_tint;
uniform vec3 hair_tint;
uniform vec3 clothes_tint;

// An approximation of the sRGB curve.
vec3 linear(vec3 c) { return c * (c * (c * 0.3053 + 0.6822) + 0.0125); }

void main() {
  vec3 albedo = linear(texture(albedo_map, coordinate).rgb);
  vec3 flat_normal = normalize(normal);
  bool hand = part > 2.5 && part < 4.5;
  bool eye = part > 90.0;
  float skin_texel = texture(skin_mask, coordinate).r;
  float skin = skin_texel;
  if (hand) skin = max(skin, 0.9);
  if (part > 6.5) skin = 0.0;
  vec3 other = part < 1.5 ? hair_tint : clothes_tint;
  // Bare legs have the tint of skin, though they shine like cloth: the mask takes some cloth for skin.
  albedo *= eye ? vec3(0.8) : mix(other, skin_tint, max(skin, skin_texel));
  if (dot(flat_normal, camera - position) < 0.0) flat_normal = -flat_normal;
  // Tangents from screen-space derivatives: the packed avatars carry none.
  vec3 dpx = dFdx(position), dpy = dFdy(position);
  vec2 dux = dFdx(coordinate), duy = dFdy(coordinate);
  vec3 py = cross(dpy, flat_normal), px = cross(flat_normal, dpx);
  vec3 t = py * dux.x + px * duy.x, b = py * dux.y + px * duy.y;
  float scale = inversesqrt(max(max(dot(t, t), dot(b, b)), 1e-20));
  vec3 bump = texture(normal_map, coordinate).xyz * 2.0 - 1.0;
  bump.xy *= 0.8;
  vec3 n = normalize(t * scale * bump.x - b * scale * bump.y + flat_normal * max(bump.z, 0.2));
  out_albedo = vec4(albedo, skin);
  out_normal = vec4(n, eye ? 1.0 : 0.0);
  out_flat = vec4(flat_normal, 1.0);
  out_position = vec4(position, 1.0);
}
