! SPDX-License-Identifier: MIT
!> A script that completes commands, options and files in a shell, made from the table that reads the command line.
module rockdda_app_completion
   use rockdda_app_command_options, only : command_names, options_of
   use rockdda_linear_factory, only : solver_names
   implicit none
   private
   public :: completion_script

   character(len=1), parameter :: nl = new_line('a')

contains

   !> The script for bash; zsh reads it, too, with its module for scripts of bash.
   pure function completion_script(shell) result(text)
      character(len=*), intent(in) :: shell
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      if (shell == 'zsh') text = 'autoload -U +X compinit bashcompinit && compinit && bashcompinit'//nl
      text = text//'_rockdda() {'//nl// &
             '  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} command= words= i'//nl// &
             '  COMPREPLY=()'//nl// &
             '  for ((i = 1; i < COMP_CWORD; i++)); do'//nl// &
             '    case ${COMP_WORDS[i]} in'//all_commands('|')//') command=${COMP_WORDS[i]}; break;; esac'//nl// &
             '  done'//nl// &
             '  case $before in'//nl// &
             '    --solver) words="'//solvers()//'";;'//nl// &
             '    --search) words="strength tilt push gravity";;'//nl// &
             '    --dialect) words="dda_windows g0";;'//nl// &
             '    --completion) words="bash zsh";;'//nl// &
             '    -o|--output|--config) command=file;;'//nl// &
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
   end function completion_script

   !> The commands with a separator between them.
   pure function all_commands(between) result(text)
      character(len=1), intent(in) :: between
      character(len=:), allocatable :: text
      integer :: i
      text = ' '
      do i = 1, size(command_names)
         if (i > 1) text = text//between
         text = text//trim(command_names(i))
      end do
   end function all_commands

   !> The solvers, between blanks.
   pure function solvers() result(text)
      character(len=:), allocatable :: text
      integer :: i
      text = solver_names
      do i = 1, len(text)
         if (text(i:i) == ',') text(i:i) = ' '
      end do
   end function solvers

end module rockdda_app_completion
