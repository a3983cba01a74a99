// cargo wants a file of Rust beside Cargo.toml; there is none to compile.
