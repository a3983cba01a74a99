# Builds Rapier, in both precisions, and the C interface of this folder as one static library with cargo, from crates that
# are fetched and checked first.
needs cargo 'which builds Rapier'
fetch_crates "${recipe}"
folder="${out}/rapier-0.36.1"
# cargo looks for the lock beside Cargo.toml, and for nothing outside of the scratch folder.
cp "${recipe}"/{Cargo.toml,Cargo.lock,*.rs} "${work}"
cd "${work}" || exit
# Whatever flags the user's own configuration of cargo has. Rust never contracts to FMA.
cpu=x86-64
[[ ${build} == baseline ]] || cpu="x86-64-${build}"
RUSTFLAGS="-C target-cpu=${cpu}" cargo build --release --locked --offline --target-dir "${work}/build" \
  --config 'source.crates-io.replace-with="fetched"' --config "source.fetched.directory='${fetched}/vendor'"
mkdir -p "${folder}/lib" "${folder}/include"
cp "${work}/build/release/libassay_rapier.a" "${folder}/lib"
cp "${recipe}/assay_rapier.h" "${folder}/include"
for licence in "${fetched}"/vendor/*/[Ll][Ii][Cc][Ee][Nn]*; do
  crate="${folder}/licenses/$(basename "$(dirname "${licence}")")"
  mkdir -p "${crate}"
  cp "${licence}" "${crate}"
done
write_facts "${folder}" "crates rapier3d and rapier3d-f64 0.36.1" "$(rustc --version)" \
  "opt-level 3, codegen-units 1, target-cpu ${cpu}, no FMA contraction"
