#!/bin/sh
# Prints a build.ninja for all missions/*.yaml: sh examples/ninja/generate.sh > build.ninja && ninja
cat <<'RULE'
rule trajc
  command = trajc compile $in --out out
  depfile = out/$mission/commands.d
  description = trajc $mission
RULE
for file in missions/*.yaml; do
    name="$(basename "$file" .yaml)"
    printf '\nbuild out/%s/commands.csv: trajc %s\n  mission = %s\n' "$name" "$file" "$name"
done
