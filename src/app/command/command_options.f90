! SPDX-License-Identifier: MIT
!> Table of the commands and of the options on the command line.
module rockdda_app_command_options
   use rockdda_app_texts, only : text_of
   implicit none
   private
   public :: command_names, model_kinds, shells, option_kind, options, find_option, is_option_of, options_of, joined, &
      model_line, list_of_models

   !> The commands, in the order of the help.
   character(len=*), parameter :: command_names(8) = [character(len=6) :: 'new', 'lines', 'cut', 'run', 'resume', &
                                                                 'fos', 'check', 'info']
   !> What 'rockdda new' makes.
   character(len=*), parameter :: model_kinds(9) = [character(len=8) :: 'slope', 'tunnel', 'arch', 'bridge', 'wall', &
                                                                 'dam', 'rocking', 'rockfall', 'shear']
   !> The words that 'rockdda completion' offers.
   character(len=*), parameter :: shells(3) = [character(len=4) :: 'bash', 'zsh', 'fish']

   type :: option_kinds
      integer :: flag = 0      !! no value
      integer :: text = 1
      integer :: whole = 2     !! a whole number
      integer :: real = 3
   end type option_kinds
   type(option_kinds), parameter :: option_kind = option_kinds()

   type :: option_type
      character(len=20) :: name
      integer :: kind                 !! of its value, one of option_kind%...
      character(len=24) :: commands   !! that take the option, between blanks; '': all
   end type option_type

   character(len=*), parameter :: writers = ' lines cut run fos ', runs = ' run resume ', &
                                  first = ' run fos ', all_runs = ' run resume fos ', fos = ' fos '
   type(option_type), parameter :: options(33) = [ &
                                   option_type('--output', option_kind%text, writers), &
                                   option_type('--seed', option_kind%whole, ' lines '), &
                                   option_type('--config', option_kind%text, ' cut run fos check '), &
                                   option_type('--threads', option_kind%whole, all_runs), &
                                   option_type('--solver', option_kind%text, first), &
                                   option_type('--steps', option_kind%whole, runs), &
                                   option_type('--t-end', option_kind%real, runs), &
                                   option_type('--save-every', option_kind%whole, first), &
                                   option_type('--max-wall', option_kind%real, all_runs), &
                                   option_type('--checkpoint-every', option_kind%real, runs), &
                                   option_type('--strict', option_kind%flag, runs), &
                                   option_type('--allow-open', option_kind%flag, ' cut run fos check '), &
                                   option_type('--search', option_kind%text, fos), &
                                   option_type('--joints', option_kind%text, fos), &
                                   option_type('--loads', option_kind%text, fos), &
                                   option_type('--factors', option_kind%text, fos), &
                                   option_type('--from', option_kind%real, fos), &
                                   option_type('--to', option_kind%real, fos), &
                                   option_type('--tolerance', option_kind%real, fos), &
                                   option_type('--stage', option_kind%text, fos), &
                                   option_type('--jobs', option_kind%whole, fos), &
                                   option_type('--max-steps', option_kind%whole, fos), &
                                   option_type('--dialect', option_kind%text, ''), &
                                   option_type('--force', option_kind%flag, ''), &
                                   option_type('--quiet', option_kind%flag, ''), &
                                   option_type('--json', option_kind%flag, ''), &
                                   option_type('--help', option_kind%flag, ''), &
                                   option_type('--version', option_kind%flag, ''), &
                                   option_type('--completion', option_kind%text, ''), &
                                   option_type('--options-table', option_kind%flag, ' check '), &
                                   option_type('--as-namelist', option_kind%flag, ' check '), &
                                   option_type('--list', option_kind%flag, ' new '), &
                                   option_type('--watch', option_kind%flag, runs)]

contains

   !> Place of an option in the table, 0 for an unknown name.
   pure integer function find_option(name)
      character(len=*), intent(in) :: name
      integer :: k
      find_option = 0
      do k = 1, size(options)
         if (options(k)%name == name) find_option = k
      end do
   end function find_option

   !> Does option k belong to a command ('': the program without a command)?
   pure logical function is_option_of(k, command)
      integer, intent(in) :: k
      character(len=*), intent(in) :: command
      is_option_of = len_trim(options(k)%commands) == 0 .or. index(options(k)%commands, ' '//command//' ') > 0
   end function is_option_of

   !> The options of a command ('': of the program without a command), with blanks between them.
   pure function options_of(command) result(names)
      character(len=*), intent(in) :: command
      character(len=:), allocatable :: names
      integer :: k
      names = ' '
      do k = 1, size(options)
         if (is_option_of(k, command)) names = names//trim(options(k)%name)//' '
      end do
   end function options_of

   !> Names with a separator between them.
   pure function joined(names, between) result(text)
      character(len=*), intent(in) :: names(:), between
      character(len=:), allocatable :: text
      integer :: i
      text = trim(names(1))
      do i = 2, size(names)
         text = text//between//trim(names(i))
      end do
   end function joined

   !> What a kind of model is: the first sentence of its file.
   pure function model_line(kind) result(text)
      character(len=*), intent(in) :: kind
      character(len=:), allocatable :: text
      text = text_of(trim(kind)//'.nml')
      text = text(3:index(text, '. Units:') - 1)
   end function model_line

   !> A line for each kind of model.
   pure function list_of_models() result(text)
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      do i = 1, size(model_kinds)
         if (i > 1) text = text//new_line('a')
         text = text//'  '//model_kinds(i)//'  '//model_line(model_kinds(i))
      end do
   end function list_of_models

end module rockdda_app_command_options
