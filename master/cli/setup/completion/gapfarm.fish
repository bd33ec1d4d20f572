# gapfarm for fish: gapfarm completion fish
function __gapfarm_words
    set -l words (commandline -opc) (commandline -ct)
    gapfarm completion words -- $words[2..-1] 2>/dev/null
end
complete -c gapfarm -f -a '(__gapfarm_words)'
