#version 330
// Nothing, in up to four pictures at once.
layout(location = 0) out vec4 first;
layout(location = 1) out vec4 second;
layout(location = 2) out vec4 third;
layout(location = 3) out vec4 fourth;

void main() {
  first = second = third = fourth = vec4(0.0);
}
