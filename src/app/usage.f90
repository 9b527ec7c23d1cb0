! SPDX-License-Identifier: MIT
!> The help texts.
module rockdda_app_usage
   use rockdda_linear_factory, only : solver_names
   use rockdda_app_model_list, only : list_of_models
   implicit none
   private
   public :: usage_text

   character(len=1), parameter :: nl = new_line('a')

contains

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

end module rockdda_app_usage
