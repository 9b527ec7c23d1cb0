! SPDX-License-Identifier: MIT
!> rockdda help: on the program, a command, the groups of a model file, one of them, or an option; and the
!> scripts that complete commands, options and files in a shell, made from the table that reads the command line.
module rockdda_app_command_help
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_base_strings, only : lower_case, replaced
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_io_option_documents, only : group_help, group_names, groups_help, group_suggestion, named_option_help
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_command_options, only : command_names, is_option_of, model_kinds, option_kind, options, &
      options_of, shells, joined, list_of_models
   use rockdda_app_process, only : print_line, print_error
   use rockdda_app_report, only : report_failure
   use rockdda_app_texts, only : text_of
   use rockdda_run_search_options, only : search_names
   use rockdda_linear_factory, only : solver_names
   implicit none
   private
   public :: run_help, refuse_nothing

   character(len=1), parameter :: nl = new_line('a')
   character(len=*), parameter :: dialects = 'dda_windows g0'

contains

   !> Print the help or the script; ok is false when printing fails, the exit code shows an unknown topic.
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

   !> Report that there is no command, after the help of the program.
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
             '    --solver) words="'//replaced(solver_names, ',', ' ')//'";;'//nl// &
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
      case ('--solver'); text = text//" -f -a '"//replaced(solver_names, ',', ' ')//"'"
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

   !> What `rockdda help` explains.
   pure function help_topics(groups) result(text)
      character(len=*), intent(in) :: groups
      character(len=:), allocatable :: text
      text = joined(command_names, ' ')//' completion groups'//groups
   end function help_topics

   !> Help on a command, or on the program when the command is ''.
   pure function usage_text(command) result(text)
      character(len=*), intent(in) :: command
      character(len=:), allocatable :: text, options_of_all
      options_of_all = text_of('common.txt')
      text = text_of(command//'.txt')
      if (len(text) == 0) text = text_of('program.txt')
      text = replaced(text(:len(text) - 1), '@COMMON@', options_of_all(:len(options_of_all) - 1))
      text = replaced(replaced(text, '@SOLVERS@', solver_names), '@MODELS@', list_of_models())
   end function usage_text

end module rockdda_app_command_help
