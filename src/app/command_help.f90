! SPDX-License-Identifier: MIT
!> rockdda help: on the program, a command, the groups of a model file, one of them, or an option; and the
!> scripts that complete commands, options and files in a shell, made from the table that reads the command line.
module rockdda_app_command_help
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_base_strings, only : lower_case
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_io_option_documents, only : group_help, group_names, groups_help, group_suggestion, named_option_help
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_command_options, only : command_names, is_option_of, model_kinds, option_kind, options, &
      options_of, shells
   use rockdda_app_process, only : print_line, print_error
   use rockdda_app_report, only : report_failure
   use rockdda_app_model_list, only : list_of_models
   use rockdda_run_search_options, only : search_names
   use rockdda_linear_factory, only : solver_names
   implicit none
   private
   public :: run_help, refuse_nothing

   character(len=1), parameter :: nl = new_line('a')
   character(len=*), parameter :: dialects = 'dda_windows g0'

contains

   !> Print the help or the script; ok is false when printing fails, the exit code tells of an unknown topic.
   subroutine run_help(line, ok, exit_code)
      type(command_line_type), intent(in) :: line    !! topic: a command is not one of them
      logical, intent(out) :: ok
      integer, intent(out) :: exit_code
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: error
      character(len=:), allocatable :: text, group
      exit_code = 0
      group = lower_case(line%topic)
      if (index(group, '&') == 1) group = group(2:)
      if (len(line%completion) > 0 .and. .not. line%help) then
         text = completion_script(line%completion, group_names())
      else if (len(line%topic) == 0 .or. line%topic == 'completion') then
         text = line%command
         if (len(line%topic) > 0) text = line%topic
         text = usage_text(text)
      else if (group == 'groups') then
         text = groups_help()
      else
         text = group_help(group)
         if (len(text) == 0) text = named_option_help(group)
      end if
      if (len(text) > 0) then
         call print_line(text, ok)
         return
      end if
      ok = .true.
      call make_error(error, error_code%input, "no help on '"//line%topic//"'"// &
                      group_suggestion(group, [character(len=10) :: command_names, 'groups', 'completion']))
      call report_failure(line, messages, error, exit_code)
   end subroutine run_help

   !> Tell that there is no command, after the help of the program.
   subroutine refuse_nothing(line, exit_code)
      type(command_line_type), intent(in) :: line
      integer, intent(out) :: exit_code
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: error
      if (.not. line%json) call print_error(usage_text(''))
      call make_error(error, error_code%input, 'no command given')
      call report_failure(line, messages, error, exit_code)
   end subroutine refuse_nothing

   !> The script for bash, zsh (which reads that of bash, too, with its module for such scripts) or fish.
   pure function completion_script(shell, groups) result(text)
      character(len=*), intent(in) :: shell
      character(len=*), intent(in) :: groups     !! names of the groups of model files, a blank before each
      character(len=:), allocatable :: text
      select case (shell)
      case ('fish'); text = fish_script(help_topics(groups))
      case ('zsh')
         text = 'autoload -U +X compinit bashcompinit && compinit && bashcompinit'//nl//bash_script(help_topics(groups))
      case default; text = bash_script(help_topics(groups))
      end select
   end function completion_script

   !> The script for bash.
   pure function bash_script(topics) result(text)
      character(len=*), intent(in) :: topics
      character(len=:), allocatable :: text
      integer :: i
      text = '_rockdda() {'//nl// &
             '  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} command= words= i'//nl// &
             '  COMPREPLY=()'//nl// &
             '  for ((i = 1; i < COMP_CWORD; i++)); do'//nl// &
             '    case ${COMP_WORDS[i]} in'//all_commands('|')//') command=${COMP_WORDS[i]}; break;; esac'//nl// &
             '  done'//nl// &
             '  case $before in'//nl// &
             '    --solver) words="'//solvers()//'";;'//nl// &
             '    --search) words="'//joined(search_names, ' ')//'";;'//nl// &
             '    --dialect) words="'//dialects//'";;'//nl// &
             '    completion|--completion) words="'//joined(shells, ' ')//'";;'//nl// &
             '    help) words="'//topics//'";;'//nl// &
             '    new) words="'//joined(model_kinds, ' ')//'";;'//nl// &
             '    -o|--output|-c|--config) command=file;;'//nl// &
             '  esac'//nl// &
             '  if [[ -z $words && $word == -* && $command != file ]]; then'//nl// &
             '    case $command in'//nl
      do i = 1, size(command_names)
         text = text//'      '//trim(command_names(i))//') words="'//options_of(trim(command_names(i)))// &
                '";;'//nl
      end do
      text = text//'      *) words="'//options_of('')//'";;'//nl// &
             '    esac'//nl// &
             '  elif [[ -z $words && -z $command ]]; then'//nl// &
             '    words="'//all_commands(' ')//'"'//nl// &
             '  fi'//nl// &
             '  if [[ -n $words ]]; then'//nl// &
             '    COMPREPLY=($(compgen -W "$words" -- "$word"))'//nl// &
             '  else'//nl// &
             "    local IFS=$'\n'"//nl// &
             '    COMPREPLY=($(compgen -f -- "$word"))'//nl// &
             '  fi'//nl// &
             '}'//nl// &
             'complete -o filenames -F _rockdda rockdda'
   end function bash_script

   !> The script for fish. Commands that read files complete them; the others do not.
   pure function fish_script(topics) result(text)
      character(len=*), intent(in) :: topics
      character(len=:), allocatable :: text
      integer :: k
      text = "complete -c rockdda -n __fish_use_subcommand -f -a '"//all_commands(' ')//"'"//nl// &
             seen('help')//" -f -a '"//topics//"'"//nl// &
             seen('new')//" -f -a '"//joined(model_kinds, ' ')//"'"//nl// &
             seen('completion')//" -f -a '"//joined(shells, ' ')//"'"
      do k = 1, size(options)
         if (options(k)%name == '--completion') cycle
         text = text//nl//fish_option(k)
      end do
   end function fish_script

   !> The line for option k.
   pure function fish_option(k) result(text)
      integer, intent(in) :: k
      character(len=:), allocatable :: text
      character(len=len(options%name)) :: name
      integer :: i
      text = ''
      do i = 1, size(command_names)
         if (is_option_of(k, trim(command_names(i)))) text = text//' '//trim(command_names(i))
      end do
      name = options(k)%name
      text = seen(text(2:))//' -l '//trim(name(3:))
      if (options(k)%kind /= option_kind%flag) text = text//' -r'
      select case (name)
      case ('--output'); text = text//' -s o -F'
      case ('--config'); text = text//' -s c -F'
      case ('--solver'); text = text//" -f -a '"//solvers()//"'"
      case ('--search'); text = text//" -f -a '"//joined(search_names, ' ')//"'"
      case ('--dialect'); text = text//" -f -a '"//dialects//"'"
      case default
         if (options(k)%kind /= option_kind%flag) text = text//' -f'
      end select
   end function fish_option

   !> The beginning of a line of fish that holds behind one of these commands, blanks between them.
   pure function seen(commands) result(text)
      character(len=*), intent(in) :: commands
      character(len=:), allocatable :: text
      text = "complete -c rockdda -n '__fish_seen_subcommand_from "//commands//"'"
   end function seen

   !> The commands with a separator between them.
   pure function all_commands(between) result(text)
      character(len=1), intent(in) :: between
      character(len=:), allocatable :: text
      text = ' '//joined(command_names, between)//between//'help'//between//'completion'
   end function all_commands

   !> Names with a separator between them.
   pure function joined(names, between) result(text)
      character(len=*), intent(in) :: names(:)
      character(len=1), intent(in) :: between
      character(len=:), allocatable :: text
      integer :: i
      text = trim(names(1))
      do i = 2, size(names)
         text = text//between//trim(names(i))
      end do
   end function joined

   !> What `rockdda help` explains.
   pure function help_topics(groups) result(text)
      character(len=*), intent(in) :: groups
      character(len=:), allocatable :: text
      text = joined(command_names, ' ')//' completion groups'//groups
   end function help_topics

   !> The solvers, between blanks.
   pure function solvers() result(text)
      character(len=:), allocatable :: text
      integer :: i
      text = solver_names
      do i = 1, len(text)
         if (text(i:i) == ',') text(i:i) = ' '
      end do
   end function solvers

   !> Help on a command, or on the program when the command is ''.
   pure function usage_text(command) result(text)
      character(len=*), intent(in) :: command
      character(len=:), allocatable :: text
      select case (command)
      case ('new'); text = new_text()
      case ('lines'); text = lines_text()
      case ('cut'); text = cut_text()
      case ('run'); text = run_text()
      case ('resume'); text = resume_text()
      case ('fos'); text = fos_text()
      case ('check'); text = check_text()
      case ('info'); text = info_text()
      case ('completion'); text = completion_text()
      case default; text = program_text()
      end select
   end function usage_text

   !> Help of the program.
   pure function program_text() result(text)
      character(len=:), allocatable :: text
      text = 'RockDDA: discontinuous deformation analysis of block systems'//nl// &
             nl// &
             'usage: rockdda COMMAND [OPTION…] FILE…'//nl// &
             nl// &
             'commands:'//nl// &
             '  new     write a labelled model to begin with: a slope, a tunnel or an arch'//nl// &
             '  lines   draw joint lines from the statistics of joint sets'//nl// &
             '  cut     cut the plane into blocks along the lines of a geometry file'//nl// &
             '  run     move the blocks in time and write the results'//nl// &
             '  resume  continue a run that was stopped, or add steps to one that is done'//nl// &
             '  fos     search the factor at which a model loses its equilibrium'//nl// &
             '  check   read input files and list every problem; computes nothing'//nl// &
             '  info    describe a model, block, result or checkpoint file'//nl// &
             nl// &
             "'rockdda help COMMAND' explains a command and gives examples, 'rockdda help GROUP' the"//nl// &
             "options of a group of a model file, such as stage, or one of them, such as duration;"//nl// &
             "'rockdda help groups' lists the groups,"//nl// &
             "'rockdda completion SHELL' prints a script that completes commands, options and files."//nl// &
             nl// &
             common_text()// &
             '  --version         version, compiler, build options, libraries'//nl// &
             nl// &
             exit_text()
   end function program_text

   !> Help of `rockdda new`.
   pure function new_text() result(text)
      character(len=:), allocatable :: text
      text = 'usage: rockdda new KIND NAME [OPTION…]'//nl// &
             '       rockdda new --list'//nl// &
             nl// &
             'Writes a small labelled model that runs, with comments on all that stands in it: NAME.nml and its'//nl// &
             'lines, NAME.dc. A model of your own grows from it.'//nl// &
             nl// &
             'kinds:'//nl// &
             list_of_models()//nl// &
             nl// &
             'options:'//nl// &
             '  --list            print the kinds, a line each'//nl// &
             common_text()// &
             nl// &
             'examples:'//nl// &
             '  rockdda new slope portal'//nl// &
             '  rockdda run portal.nml'//nl// &
             '  rockdda fos portal.nml'
   end function new_text

   !> Help of `rockdda lines`.
   pure function lines_text() result(text)
      character(len=:), allocatable :: text
      text = 'usage: rockdda lines MODEL.dl [-o MODEL.dc] [OPTION…]'//nl// &
             nl// &
             'Draws the lines of joint sets from their statistics (spacing, trace length, bridge, randomness),'//nl// &
             'cuts them to the boundary and the openings, and writes a geometry file. Prints the'//nl// &
             'statistics drawn beside those wanted. The same seed gives the same lines on every machine.'//nl// &
             nl// &
             'options:'//nl// &
             '  -o, --output FILE the geometry file; default: the stem of the statistics file + .dc in the'//nl// &
             '                    current folder'//nl// &
             '  --seed N          replaces the seed of the file; 0 to 2147483646'//nl// &
             common_text()// &
             nl// &
             'examples:'//nl// &
             '  rockdda lines tunnel.dl'//nl// &
             '  rockdda lines tunnel.dl --seed 7 -o tunnel-7.dc'//nl// &
             '  rockdda lines tunnel.dl --json | python3 -m json.tool'
   end function lines_text

   !> Help of `rockdda cut`.
   pure function cut_text() result(text)
      character(len=:), allocatable :: text
      text = 'usage: rockdda cut MODEL.dc [-o MODEL.blk] [OPTION…]'//nl// &
             nl// &
             'Cuts the plane into blocks along the lines of a geometry file and writes a block file. Prints the'//nl// &
             'number of blocks, a check of the areas, and the lines that were dropped. With options, blocks of'//nl// &
             'their regions (&subdivide) are cut into cells.'//nl// &
             nl// &
             'options:'//nl// &
             '  -o, --output FILE the block file; default: the stem of the geometry file + .blk in the current'//nl// &
             '                    folder'//nl// &
             '  --config FILE     namelist file with run options; of these &region, &subdivide and allow_open '// &
             'count'//nl// &
             '  --allow-open      an outline that does not close is a warning, not an error'//nl// &
             common_text()// &
             nl// &
             'examples:'//nl// &
             '  rockdda cut slope.dc'//nl// &
             '  rockdda cut slope.dc -o blocks/slope.blk --force'//nl// &
             '  rockdda cut slope.dc --json | python3 -m json.tool'
   end function cut_text

   !> Help of `rockdda run`.
   pure function run_text() result(text)
      character(len=:), allocatable :: text
      text = 'usage: rockdda run MODEL.blk MODEL.df [-o OUT.h5] [OPTION…]'//nl// &
             '       rockdda run MODEL.dc MODEL.df [-o OUT.h5] [OPTION…]'//nl// &
             '       rockdda run MODEL.nml [-o OUT.h5] [OPTION…]'//nl// &
             '       rockdda run FOLDER [-o OUT.h5] [OPTION…]'//nl// &
             nl// &
             'Moves the blocks in time and writes the results (HDF5), and beside OUT.h5 a log (OUT.log) and a'//nl// &
             "checkpoint (OUT.ckpt.h5) from which 'rockdda resume' continues. A"//nl// &
             'geometry file is cut into blocks first. A labelled file (.nml with &model) names its geometry'//nl// &
             'and holds all the rest. A folder holds one labelled file, or one geometry or block file, one'//nl// &
             'analysis file and at most one namelist file (.nml). Kinds of files are recognised by their'//nl// &
             'content.'//nl// &
             nl// &
             'options (each but --config has a name in the namelist file; the command line prevails):'//nl// &
             '  -o, --output FILE '// &
             'the results; default: the stem of the analysis or labelled file + .h5 here'//nl// &
             '  -c, --config FILE namelist file with run options, beside a geometry and an analysis file'//nl// &
             '  --steps N         number of steps'//nl// &
             '  --t-end T         end time; the last step is shortened to land on it'//nl// &
             '  --save-every K    a frame every K steps; default: about 100 frames in the run'//nl// &
             '  --solver NAME     '//solver_names//nl// &
             '  --threads N       number of threads; results do not depend on it'//nl// &
             '  --max-wall S      stop after S seconds on the wall clock (exit 4)'//nl// &
             '  --checkpoint-every S'//nl// &
             '                    a checkpoint every S seconds; default: 60'//nl// &
             '  --allow-open      an outline that does not close is a warning, not an error'//nl// &
             '  --watch           open the results in the browser (rockdda-post view) while they are computed; the'// &
                nl// &
             '                    command then lasts until Ctrl-C'//nl// &
             '  --strict          end the run (exit 3) instead of warning when the energy balance fails, blocks'//nl// &
             '                    stand inside each other or a static stage ends without equilibrium'//nl// &
             common_text()// &
             nl// &
             'SIGTERM, SIGINT, SIGUSR1, SIGUSR2, SIGXCPU and SIGHUP (not under nohup) end the run'//nl// &
             'within the current step, which is dropped, with everything before it in OUT.h5 and a'//nl// &
             'checkpoint (exit 4); a second SIGINT ends it at once.'//nl// &
             nl// &
             'examples:'//nl// &
             '  rockdda run slope.nml'//nl// &
             '  rockdda run slope.dc slope.df'//nl// &
             '  rockdda run slope.blk slope.df -o out/slope.h5 --steps 2000 --save-every 20'//nl// &
             '  rockdda run inputs/incline --quiet --json'//nl// &
             '  rockdda run slope.dc slope.df --config slope.nml --max-wall 3600'
   end function run_text

   !> Help of `rockdda resume`.
   pure function resume_text() result(text)
      character(len=:), allocatable :: text
      text = 'usage: rockdda resume OUT.ckpt.h5 [--steps N] [OPTION…]'//nl// &
             nl// &
             'Continues the run of a checkpoint in the same OUT.h5, which lies beside it and is first cut back'//nl// &
             'to the checkpoint. The results are bit by bit those of a run that never stopped. Without options'//nl// &
             'it continues to the planned end of the run; a run that is done already is not changed.'//nl// &
             nl// &
             'options:'//nl// &
             '  --steps N         N more steps from the checkpoint'//nl// &
             '  --t-end T         end time, instead of the one of the run'//nl// &
             '  --threads N       number of threads; results do not depend on it'//nl// &
             '  --max-wall S      stop after S seconds on the wall clock (exit 4); one given to the run itself'//nl// &
             '                    does not count here'//nl// &
             '  --checkpoint-every S'//nl// &
             '                    a checkpoint every S seconds; default: as in the run'//nl// &
             '  --strict          end the run (exit 3) instead of warning when the energy balance fails, blocks'//nl// &
             '                    stand inside each other or a static stage ends without equilibrium; '// &
             'one given to the run'//nl// &
             '                    itself does not count here'//nl// &
             '  --watch           open the results in the browser (rockdda-post view), as of rockdda run'//nl// &
             common_text()// &
             nl// &
             'examples:'//nl// &
             '  rockdda resume slope.ckpt.h5'//nl// &
             '  rockdda resume out/slope.ckpt.h5 --steps 1000 --threads 8'//nl// &
             '  rockdda resume slope.ckpt.h5 --max-wall 3600 --quiet --json'
   end function resume_text

   !> Help of `rockdda fos`.
   pure function fos_text() result(text)
      character(len=:), allocatable :: text
      text = 'usage: rockdda fos MODEL.nml [OPTION…]'//nl// &
             '       rockdda fos FOLDER [OPTION…]'//nl// &
             '       rockdda fos MODEL.dc MODEL.df [OPTION…]'//nl// &
             nl// &
             'Searches the factor at which the model loses its equilibrium. The model first comes to rest, at'//nl// &
             'the end of a stage; from that state each trial begins with another value of one quantity and ends'//nl// &
             'at rest (stable) or in a motion that does not stop (failing). The last line tells the factor.'//nl// &
             'A model that does not stand first gets 2, 4 ... 64 times the strength of the joints searched: its'//nl// &
             'factor is below 1.'//nl// &
             nl// &
             'options:'//nl// &
             '  --search KIND     '// &
             'strength: tan of friction angles, cohesion and tension divided by F (default);'//nl// &
             '                    tilt: gravity turned by degrees, counter-clockwise; push: a horizontal load'//nl// &
             '                    of F times the weight on every block; gravity: multiplied by F; load: the'//nl// &
             '                    loads of --loads multiplied by F, which are 0 before the search'//nl// &
             '  --joints NAMES    joint materials whose strength is reduced, commas between them; default: all'//nl// &
             '  --loads NAMES     names of &loading_point, &line_load and &boundary that are multiplied, commas'//nl// &
             '                    between them; default: all that have a name'//nl// &
             '  --factors LIST    does the model stand with these design factors, and with what reserve of'//nl// &
             '                    strength (exit 3: it does not): friction = 1.25, cohesion = 1.25,'//nl// &
             '                    tension = 1.25, load.NAME = 1.3, water = 1; or ec7: strength 1.25, --loads 1.3'// &
                nl// &
             '  --from A          a value at which the model is stable; default: 1, tilt, push and load 0'//nl// &
             '  --to B            a value at which it fails; default: found by doubling. Below A: tilt'//nl// &
             '                    clockwise, push in -x, loads reversed'//nl// &
             '  --tolerance D     '// &
             'largest distance of the two values at the end; default: 0.01, tilt 0.1 degrees,'//nl// &
             '                    push 0.005, load 0.005 of the value, with --factors 0.002'//nl// &
             '  --stage NAME      the stage after which the search begins; default: the last one'//nl// &
             '  --jobs N          so many trials at a time; the result does not depend on it'//nl// &
             '  --max-steps N     steps of a trial; default: 5000'//nl// &
             '  -o, --output FILE the run of the failing trial nearest to the factor as results, with the group'//nl// &
             '                    /search; default: none is written'//nl// &
             '  -c, --config FILE namelist file with run options, beside a geometry and an analysis file'//nl// &
             '  --allow-open      an outline that does not close is a warning, not an error'//nl// &
             '  --save-every K    a frame of it every K steps'//nl// &
             '  --solver NAME     '//solver_names//nl// &
             '  --threads N       number of threads of a single trial'//nl// &
             '  --max-wall S      stop after S seconds on the wall clock (exit 4)'//nl// &
             common_text()// &
             nl// &
             'A search that was stopped or killed continues when the same command is given again: its finished'//nl// &
             'trials and the state at rest are kept beside the results, or in the current folder, until it'//nl// &
             'ends.'//nl// &
             nl// &
             'examples:'//nl// &
             '  rockdda fos slope.nml'//nl// &
             '  rockdda fos slope.nml --joints bedding --stage drained -o slope-fails.h5'//nl// &
             '  rockdda fos inputs/stack --search tilt --tolerance 0.05'//nl// &
             '  rockdda fos wall.nml --search push --to -1 --jobs 4 --json'//nl// &
             '  rockdda fos bridge.nml --search load --loads axle'//nl// &
             '  rockdda fos slope.nml --factors ec7'
   end function fos_text

   !> Help of `rockdda check`.
   pure function check_text() result(text)
      character(len=:), allocatable :: text
      text = 'usage: rockdda check FILE… [OPTION…]'//nl// &
             nl// &
             'Reads input files (or the model in a folder) and lists every problem with file, line and column.'//nl// &
             'A geometry and an analysis file together are also checked against each other. Nothing is computed'//nl// &
             'and nothing is written. The exit code is 0 when there is no error, else 2.'//nl// &
             nl// &
             'options:'//nl// &
             '  --as-namelist     print the labelled file (.nml with &model) of the files of one run instead:'//nl// &
             '                    run by itself it gives the same results, bit for bit'//nl// &
             '  -c, --config FILE namelist file with run options, as one of the files'//nl// &
             '  --allow-open      an outline that does not close is a warning, not an error'//nl// &
             '  --options-table   print all options of a run as a Markdown table, with --json as a JSON Schema,'//nl// &
             '                    instead of checking files'//nl// &
             common_text()// &
             nl// &
             'examples:'//nl// &
             '  rockdda check slope.dc'//nl// &
             '  rockdda check slope.nml'//nl// &
             '  rockdda check slope.dc slope.df options.nml'//nl// &
             '  rockdda check --as-namelist slope.dc slope.df > slope.nml'//nl// &
             '  rockdda check slope.df --dialect dda_windows --json'
   end function check_text

   !> Help of `rockdda info`.
   pure function info_text() result(text)
      character(len=:), allocatable :: text
      text = 'usage: rockdda info FILE… [OPTION…]'//nl// &
             nl// &
             'Describes geometry, analysis, namelist, block, result and checkpoint files (or those of the model'//nl// &
             'in a folder).'//nl// &
             nl// &
             common_text()// &
             nl// &
             'examples:'//nl// &
             '  rockdda info slope.dc slope.df'//nl// &
             '  rockdda info slope.h5 --json'//nl// &
             '  rockdda info inputs/incline'
   end function info_text

   !> Help of `rockdda completion`.
   pure function completion_text() result(text)
      character(len=:), allocatable :: text
      text = 'usage: rockdda completion bash|zsh|fish'//nl// &
             nl// &
             'Prints a script that completes commands, options, their values, topics of the help and files.'//nl// &
             nl// &
             'examples:'//nl// &
             '  eval "$(rockdda completion bash)"                                     in ~/.bashrc'//nl// &
             '  eval "$(rockdda completion zsh)"                                      in ~/.zshrc'//nl// &
             '  rockdda completion fish > ~/.config/fish/completions/rockdda.fish'
   end function completion_text

   !> Options of all commands.
   pure function common_text() result(text)
      character(len=:), allocatable :: text
      text = 'options of all commands:'//nl// &
             '  --force           overwrite output that exists'//nl// &
             '  --quiet           no progress, no warnings; errors and the summary only'//nl// &
             '  --json            the summary on standard output as JSON'//nl// &
             '  --dialect NAME    dda_windows or g0: how to read the analysis file; default: by counting its'//nl// &
             '                    numbers'//nl// &
             '  --help            this text'//nl
   end function common_text

   !> Exit codes.
   pure function exit_text() result(text)
      character(len=:), allocatable :: text
      text = 'exit codes:'//nl// &
             '  0  done'//nl// &
             '  1  internal error: a bug, please report it'//nl// &
             '  2  bad usage or bad input: nothing was computed, nothing overwritten'//nl// &
             '  3  the computation could not go on; results so far are kept'//nl// &
             "  4  stopped by a signal or --max-wall; a checkpoint was written, 'rockdda resume' continues"//nl// &
             '  5  output could not be written; what was written before is readable'
   end function exit_text

end module rockdda_app_command_help
