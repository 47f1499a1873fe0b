#version 330
// Share of the light on a surface of the room that people leave to it, red, green, blue.
in vec3 position;
in vec3 normal;
in vec2 coordinate;
out vec4 colour;
uniform sampler2D albedo_map;
uniform vec3 tint;
uniform vec3 emission;

#include lighting.glsl

void main() {
  vec3 n = normalize(normal);
  vec4 raised = vec4(position + n * shadow_raise, 1.0);
  float angle = noise(gl_FragCoord.xy + jitter) * 6.2831853;
  vec2 turn = vec2(cos(angle), sin(angle));
  vec3 all = vec3(0.0), left = vec3(0.0);
  float seen = 0.0;
  for (int i = 0; i < lamps; i++) {
    vec3 l = lamp_position[i] - position;
    float d2 = dot(l, l);
    vec3 light = lamp_colour[i] * max(dot(n, l) * inversesqrt(d2), 0.0) * (i < key_lamps ? reach(i, d2) : 1.0);
    float s = lit(i, raised, turn, i < key_lamps ? 2.0 : 1.0);
    seen += s;
    all += light;
    left += light * s;
  }
  vec3 around = ambient(n);
  vec3 own = emission / max(texture(albedo_map, coordinate).rgb * tint, vec3(0.02));
  vec3 share = (left + around * occlusion(seen) + own + 0.003) / (all + around + own + 0.003);
  colour = vec4(share, 1.0);
}
