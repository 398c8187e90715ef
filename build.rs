//! Gives the shared library its SONAME, which carries the ABI number.

fn main() {
    const SOURCE: &str = "src/capi/version.rs";
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed={SOURCE}");
    // the one place where the number stands; the header has it from there too
    let text = std::fs::read_to_string(SOURCE).expect(SOURCE);
    let abi = text.split_once("AR_ABI_VERSION: u32 = ").and_then(|(_, t)| t.split_once(';')).expect("AR_ABI_VERSION").0;
    match std::env::var("CARGO_CFG_TARGET_OS").unwrap_or_default().as_str() {
        "windows" => {}
        "macos" | "ios" => println!("cargo::rustc-cdylib-link-arg=-Wl,-install_name,@rpath/libarmesh.{abi}.dylib"),
        _ => println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,libarmesh.so.{abi}"),
    }
}
