# Bullet's library again, in single precision.
precision=f32
# shellcheck source=/dev/null
source "${root}/src/engines/bullet/recipe/build.sh"
