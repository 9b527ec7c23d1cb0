! SPDX-License-Identifier: MIT
!> The command line as a record.
module rockdda_app_arguments
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_random, only : largest_seed
   use rockdda_base_strings, only : to_string
   use rockdda_model_analysis_input, only : dialect
   use rockdda_model_options, only : unset_integer
   use rockdda_io_numbers, only : parse_number, number_status, is_whole
   use rockdda_io_suggest, only : did_you_mean
   use rockdda_run_model_input, only : run_request_type
   use rockdda_app_process, only : argument_type
   implicit none
   private
   public :: command_line_type, parse_command_line, command_names, options_of

   !> The commands, in the order of the help.
   character(len=*), parameter :: command_names(6) = [character(len=6) :: 'lines', 'cut', 'run', 'resume', 'check', &
                                                                 'info']
   !> Those that write a file.
   character(len=*), parameter :: writers = ' lines cut run '

   type, extends(run_request_type) :: command_line_type
      character(len=:), allocatable :: command       !! '' when none was given
      type(argument_type), allocatable :: files(:)
      integer :: seed = unset_integer
      character(len=:), allocatable :: completion    !! shell, '' when not asked for
      logical :: help = .false., version = .false., quiet = .false., json = .false.
   end type command_line_type

   !> What an option takes.
   integer, parameter :: takes_nothing = 0, takes_text = 1, takes_whole = 2, takes_real = 3

   type :: option_type
      character(len=20) :: name
      integer :: takes
      character(len=24) :: commands                  !! those that know it, between blanks; '' = all
   end type option_type

   character(len=*), parameter :: run_only = ' run ', runs = ' run resume '
   type(option_type), parameter :: known(19) = [ &
                                   option_type('--output', takes_text, writers), &
                                   option_type('--seed', takes_whole, ' lines '), &
                                   option_type('--config', takes_text, run_only), &
                                   option_type('--threads', takes_whole, runs), &
                                   option_type('--solver', takes_text, run_only), &
                                   option_type('--steps', takes_whole, runs), &
                                   option_type('--t-end', takes_real, runs), &
                                   option_type('--save-every', takes_whole, run_only), &
                                   option_type('--max-wall', takes_real, runs), &
                                   option_type('--checkpoint-every', takes_real, runs), &
                                   option_type('--strict', takes_nothing, runs), &
                                   option_type('--dialect', takes_text, ''), &
                                   option_type('--force', takes_nothing, ''), &
                                   option_type('--quiet', takes_nothing, ''), &
                                   option_type('--json', takes_nothing, ''), &
                                   option_type('--help', takes_nothing, ''), &
                                   option_type('--version', takes_nothing, ''), &
                                   option_type('--completion', takes_text, ''), &
                                   option_type('--', takes_nothing, '')]
   character(len=*), parameter :: dialect_names(2) = [character(len=4) :: 'peer', 'g0']

contains

   !> Understand the command line. All problems come in one error, one per line. What could be understood is in
   !> the record even then (so that --json and --help hold).
   subroutine parse_command_line(arguments, line, error)
      type(argument_type), intent(in) :: arguments(:)
      type(command_line_type), intent(out) :: line
      type(error_type), allocatable, intent(out) :: error
      character(len=:), allocatable :: problems, word, value
      integer :: i, k, equals
      logical :: only_files, has_value
      logical :: given(size(known))
      problems = ''
      value = ''
      given = .false.
      only_files = .false.
      line%command = ''
      line%output = ''
      line%config = ''
      line%solver = ''
      line%completion = ''
      allocate (line%files(0))
      i = 0
      do while (i < size(arguments))
         i = i + 1
         word = arguments(i)%text
         if (only_files .or. len(word) < 2 .or. word(1:min(1, len(word))) /= '-') then
            call add_word(word)
            cycle
         end if
         equals = index(word, '=')
         has_value = equals > 0 .and. word(1:min(2, len(word))) == '--'
         value = ''
         if (has_value) then
            value = word(equals + 1:)
            word = word(1:equals - 1)
         end if
         if (word == '-o') word = '--output'
         if (word == '-h') word = '--help'
         k = find_option(word)
         if (k == 0) then
            call problem('unknown option '//word//did_you_mean(word, known(:size(known) - 1)%name))
            cycle
         end if
         if (word == '--') then
            only_files = .true.
            cycle
         end if
         given(k) = .true.
         if (known(k)%takes == takes_nothing) then
            if (has_value) call problem('option '//word//' takes no value')
         else if (.not. has_value) then
            if (.not. value_follows()) then
               call problem('option '//word//' needs a value')
               cycle
            end if
            i = i + 1
            value = arguments(i)%text
         end if
         call take(word, value)
      end do
      if (len(line%command) > 0) then
         do k = 1, size(known)
            if (.not. given(k) .or. len_trim(known(k)%commands) == 0) cycle
            if (index(known(k)%commands, ' '//line%command//' ') > 0) cycle
            call problem("option "//trim(known(k)%name)//" does not belong to 'rockdda "//line%command//"'")
         end do
      end if
      if (len(problems) > 0) call make_error(error, error_code%input, problems)

   contains

      !> Is there a word behind this one, and is it no option? (A file with such a name is ./--name.)
      logical function value_follows()
         value_follows = i < size(arguments)
         if (value_follows) value_follows = find_option(arguments(i + 1)%text) == 0
      end function value_follows

      !> A word that is no option: the command, then files.
      subroutine add_word(word)
         character(len=*), intent(in) :: word
         type(argument_type), allocatable :: more(:)
         if (len(line%command) == 0 .and. .not. only_files) then
            if (any(command_names == word)) then
               line%command = word
            else if (word == 'help') then
               line%help = .true.
            else if (len(word) == 0) then
               call problem('a command is needed, found an empty word')
            else
               call problem("unknown command '"//word//"'"//did_you_mean(word, command_names))
               line%command = '?'
            end if
            return
         end if
         allocate (more(size(line%files) + 1))
         more(1:size(line%files)) = line%files
         more(size(more))%text = word
         call move_alloc(more, line%files)
         if (len(word) == 0) call problem('a file name is empty')
      end subroutine add_word

      !> Keep the value of an option.
      subroutine take(name, value)
         character(len=*), intent(in) :: name, value
         select case (name)
         case ('--help'); line%help = .true.
         case ('--version'); line%version = .true.
         case ('--strict'); line%strict = .true.
         case ('--force'); line%force = .true.
         case ('--quiet'); line%quiet = .true.
         case ('--json'); line%json = .true.
         case ('--output'); call take_path(name, value, line%output)
         case ('--config'); call take_path(name, value, line%config)
         case ('--solver'); line%solver = value
         case ('--completion')
            line%completion = value
            if (value /= 'bash' .and. value /= 'zsh') call problem("option --completion: '"//value// &
                                                                   "' is neither bash nor zsh")
         case ('--dialect')
            if (any(dialect_names == value)) then
               line%dialect = merge(dialect%peer, dialect%g0, value == 'peer')
            else
               call problem("option --dialect: '"//value//"' is neither peer nor g0")
            end if
         case ('--seed')
            call take_whole(name, value, 0, line%seed, largest_seed)
         case ('--threads'); call take_whole(name, value, 1, line%threads)
         case ('--steps'); call take_whole(name, value, 0, line%steps)
         case ('--save-every'); call take_whole(name, value, 1, line%save_every)
         case ('--t-end'); call take_positive(name, value, line%t_end)
         case ('--max-wall'); call take_positive(name, value, line%max_wall)
         case ('--checkpoint-every'); call take_positive(name, value, line%checkpoint_every)
         end select
      end subroutine take

      !> A path.
      subroutine take_path(name, value, path)
         character(len=*), intent(in) :: name, value
         character(len=:), allocatable, intent(inout) :: path
         path = value
         if (len_trim(value) == 0) call problem('option '//name//': expected a file name, found nothing')
      end subroutine take_path

      !> A whole number that is not below `least`.
      subroutine take_whole(name, value, least, number, most)
         character(len=*), intent(in) :: name, value
         integer, intent(in) :: least
         integer, intent(inout) :: number
         integer, intent(in), optional :: most
         real(wp) :: x
         integer :: status, highest
         highest = huge(highest)
         if (present(most)) highest = most
         call parse_number(value, x, status)
         if (status == number_status%ok .and. x > highest) then
            call problem('option '//name//': must be '//to_string(highest)//' or less, found '//value)
         else if (status /= number_status%ok .or. .not. is_whole(x)) then
            call problem('option '//name//": expected a whole number, found '"//value//"'")
         else if (nint(x) < least) then
            call problem('option '//name//': must be '//to_string(least)//' or more, found '//value)
         else
            number = nint(x)
         end if
      end subroutine take_whole

      !> A number above zero.
      subroutine take_positive(name, value, number)
         character(len=*), intent(in) :: name, value
         real(wp), intent(inout) :: number
         real(wp) :: x
         integer :: status
         call parse_number(value, x, status)
         if (status /= number_status%ok) then
            call problem('option '//name//": expected a number, found '"//value//"'")
         else if (.not. x > 0) then
            call problem('option '//name//': must be above 0, found '//value)
         else
            number = x
         end if
      end subroutine take_positive

      !> One more problem.
      subroutine problem(text)
         character(len=*), intent(in) :: text
         if (len(problems) > 0) problems = problems//new_line('a')
         problems = problems//text
      end subroutine problem

   end subroutine parse_command_line

   !> The options of a command ('': of the program without one), with blanks between them.
   pure function options_of(command) result(names)
      character(len=*), intent(in) :: command
      character(len=:), allocatable :: names
      integer :: k
      names = ' '
      do k = 1, size(known) - 1
         if (len_trim(known(k)%commands) > 0 .and. index(known(k)%commands, ' '//command//' ') == 0) cycle
         names = names//trim(known(k)%name)//' '
      end do
   end function options_of

   !> Place of an option among those known, 0 when it is not.
   pure integer function find_option(name)
      character(len=*), intent(in) :: name
      integer :: k
      find_option = 0
      do k = 1, size(known)
         if (known(k)%name == name) find_option = k
      end do
   end function find_option

end module rockdda_app_arguments
