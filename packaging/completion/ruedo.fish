# Completion for fish: the program says what may stand at the cursor.
function __ruedo_complete
    set -l words (commandline -opc)
    for line in (ruedo complete -- $words[2..] =(commandline -ct) 2>/dev/null)
        if test "$line" = ' files'
            __fish_complete_path (commandline -ct)
        else
            echo $line
        end
    end
end
complete -c ruedo -f -a '(__ruedo_complete)'
