#version 330
// One surface as seen by the camera.
invariant gl_Position;
in vec3 in_position;
in vec3 in_normal;
in vec2 in_texture;
in float in_part;
uniform mat4 view_projection;
out vec3 position;
out vec3 normal;
out vec2 coordinate;
out float part;
flat out float whole_part;  // of one corner: between two parts no third one shows

void main() {
  position = in_position;
  normal = in_normal;
  coordinate = in_texture;
  part = in_part;
  whole_part = in_part;
  gl_Position = view_projection * vec4(in_position, 1.0);
}
