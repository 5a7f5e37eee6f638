#!/bin/sh
# update_printed.sh SIMFLEX: writes anew what the guide has from the program: the key reference, the prompt's commands.
set -eu
simflex=$(realpath "$1")
cd "$(dirname "$0")/../../examples/guide"
{
    printf '# Keys of model files\n\n'
    # shellcheck disable=SC2016 # Markdown's code
    printf '%s\n%s\n' 'This page lists every key, as printed by `simflex keys --markdown`. [Model files](model_file.md) explains how to use them.' \
        'Numbers may be formulas of parameters. NAME stands for a name that you choose.'
    "$simflex" keys --markdown
} >model_keys.md.new
mv model_keys.md.new model_keys.md
{
    sed '/^## Commands$/q' prompt.md
    echo
    "$simflex" shell -q -c 'help --markdown'
} >prompt.md.new
mv prompt.md.new prompt.md
