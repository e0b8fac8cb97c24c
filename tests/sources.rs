use impinge::scene::Scene;
use impinge::source::place;
use std::path::Path;
use std::time::Instant;
fn scene(domain: &str, sources: &str) -> Scene {
    let text =
        format!("run.until = 1.0\ndomain = {{ {domain} }}\ngrain = {{ radius = 0.01, density = 2500.0 }}\n{sources}");
    toml::from_str(&text).unwrap_or_else(|error| panic!("{error}"))
}
fn block(count: u64, more: &str) -> String {
    format!("[[source]]\nkind = \"block\"\ncount = {count}\nvelocity = [0.0, 0.0, 0.0]\n{more}\n")
}
#[test]
fn jammed() {
    for (domain, inside) in [
        ("min=[-1.0,-1.0,-1.0],max=[3.0,3.0,3.0]", "centres"),
        ("min=[-1.0,-1.0,-1.0],max=[3.0,3.0,3.0]", "grains"),
        ("min=[0.0,0.0,0.0],max=[2.5,0.2,0.2],boundary=\"periodic\"", "centres"),
    ] {
        for seed in 1..9 {
            let t = Instant::now();
            let mut s =
                scene(domain, &block(11000, &format!("min=[0.0,0.0,0.0]\nmax=[2.5,0.2,0.2]\ninside=\"{inside}\"")));
            s.seed = seed;
            let r = place(&s, Path::new("."), &|_, _| None);
            println!("{domain} {inside} {:?} {:?}", t.elapsed(), r.unwrap_err().what.split("of").next().unwrap());
        }
    }
}
