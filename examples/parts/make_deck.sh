#!/bin/sh
# make_deck.sh GEO OUTPUT ELEMENT [MATERIAL] [GMSH OPTIONS…]: meshes GEO with Gmsh and writes a CalculiX deck.
#   OUTPUT             the deck: material, section, *INCLUDE of the mesh beside it (OUTPUT's name + _mesh.inp)
#   ELEMENT            element type of the solids: C3D8R, C3D8, C3D10 …
#   MATERIAL           default aluminium:  Young's modulus  Poisson's ratio  density
#     aluminium                                    70 GPa             0.3   2700 kg/m³
#     titanium         Ti-6Al-4V                  114 GPa            0.33   4430 kg/m³
#     nickel           Inconel 718                200 GPa            0.29   8190 kg/m³
# Lengths in metres.
# Example: make_deck.sh crank.geo build/crank.inp C3D8R -setnumber h 0.002
set -eu
[ $# -ge 3 ] || { echo "usage: $0 GEO OUTPUT ELEMENT [MATERIAL] [GMSH OPTIONS…]" >&2; exit 2; }
geo=$1 deck=$2 element=$3 material=aluminium
shift 3
case ${1--} in
    -*) ;;
    *) material=$1; shift ;;
esac
case $material in
    aluminium) elastic='70E9, 0.3' density=2700 ;;
    titanium) elastic='114E9, 0.33' density=4430 ;;
    nickel) elastic='200E9, 0.29' density=8190 ;;
    *) echo "$0: unknown material '$material'; there are aluminium, titanium and nickel" >&2; exit 2 ;;
esac
name=$(printf '%s' "$material" | tr '[:lower:]' '[:upper:]')
mesh=${deck%.inp}_mesh.inp
trap 'rm -f "$mesh.new.inp"' EXIT
if ! log=$(gmsh -3 "$@" "$geo" -o "$mesh.new.inp" 2>&1) || printf '%s' "$log" | grep -q '^Error'; then
    printf '%s\n' "$log" >&2
    exit 1
fi
# Gmsh knows one brick; CalculiX has several.
sed "s/type=C3D[0-9]*,/type=$element,/" "$mesh.new.inp" > "$mesh"
cat > "$deck" <<DECK
*INCLUDE, INPUT=$(basename "$mesh")
*MATERIAL, NAME=$name
*ELASTIC
$elastic
*DENSITY
$density
*SOLID SECTION, ELSET=BODY, MATERIAL=$name
DECK
