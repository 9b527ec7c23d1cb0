! SPDX-License-Identifier: MIT
!> The command line as a record.
module rockdda_app_arguments
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_base_random, only : largest_seed
   use rockdda_base_strings, only : to_string
   use rockdda_model_analysis_input, only : dialect
   use rockdda_model_options, only : unset_integer, dda_windows, old_dda_windows, most_threads
   use rockdda_base_numbers, only : parse_number, number_status, is_whole
   use rockdda_base_suggest, only : did_you_mean
   use rockdda_run_input, only : run_request_type
   use rockdda_run_search_options, only : search_options_type, search_names
   use rockdda_app_command_options, only : command_names, option_kind, options, find_option, is_option_of, shells
   use rockdda_app_process, only : argument_type, add_argument
   implicit none
   private
   public :: command_line_type, parse_command_line

   type, extends(run_request_type) :: command_line_type
      character(len=:), allocatable :: command       !! '' when none was given
      type(argument_type), allocatable :: files(:)
      integer :: seed = unset_integer
      type(search_options_type) :: search
      character(len=:), allocatable :: completion    !! shell, '' without the option
      character(len=:), allocatable :: topic         !! of `rockdda help`, '' for the program or a command
      logical :: help = .false., version = .false., quiet = .false., json = .false., options_table = .false., &
                 as_namelist = .false., list = .false., watch = .false.
   end type command_line_type

   character(len=*), parameter :: unknown_shell = '?'    !! of 'rockdda completion' without one

   !> The command line while it is read.
   type :: parser_type
      type(command_line_type) :: line
      character(len=:), allocatable :: problems      !! one per line
      logical :: is_given(size(options)) = .false.
   contains
      procedure :: read_option
      procedure :: read_word
      procedure :: set_option
      procedure :: check_options
   end type parser_type

contains

   !> Read the command line. All problems come in one error, one per line. Valid options are in the record even then (so
   !> that --json and --help hold).
   subroutine parse_command_line(arguments, line, error)
      type(argument_type), intent(in) :: arguments(:)
      type(command_line_type), intent(out) :: line
      type(error_type), allocatable, intent(out) :: error
      type(parser_type) :: parser
      integer :: i
      logical :: only_files
      parser%problems = ''
      parser%line%command = ''
      parser%line%output = ''
      parser%line%config = ''
      parser%line%solver = ''
      parser%line%completion = ''
      parser%line%topic = ''
      parser%line%search%joints = ''
      parser%line%search%loads = ''
      parser%line%search%factors = ''
      parser%line%search%stage = ''
      allocate (parser%line%files(0))
      only_files = .false.
      i = 1
      do while (i <= size(arguments))
         if (.not. only_files .and. arguments(i)%text == '--') then
            only_files = .true.
         else if (only_files .or. len(arguments(i)%text) < 2 .or. index(arguments(i)%text, '-') /= 1) then
            call parser%read_word(arguments(i)%text, only_files)
         else
            call parser%read_option(arguments, i)
         end if
         i = i + 1
      end do
      call parser%check_options()
      line = parser%line
      if (len(parser%problems) > 0) call make_error(error, error_code%input, parser%problems)
   end subroutine parse_command_line

   !> Read an option and its value: --name=value, --name value, or --name.
   subroutine read_option(self, arguments, i)
      class(parser_type), intent(inout) :: self
      type(argument_type), intent(in) :: arguments(:)
      integer, intent(inout) :: i             !! the argument; on return the last one that was read
      character(len=:), allocatable :: name, value
      integer :: k, equals
      logical :: has_value
      name = arguments(i)%text
      value = ''
      equals = index(name, '=')
      has_value = equals > 0 .and. index(name, '--') == 1
      if (has_value) then
         value = name(equals + 1:)
         name = name(1:equals - 1)
      end if
      if (name == '-o') name = '--output'
      if (name == '-c') name = '--config'
      if (name == '-h') name = '--help'
      k = find_option(name)
      if (k == 0) then
         call add_problem(self%problems, 'unknown option '//name//did_you_mean(name, options%name))
         return
      end if
      self%is_given(k) = .true.
      if (options(k)%kind == option_kind%flag) then
         if (has_value) call add_problem(self%problems, 'option '//name//' takes no value')
      else if (.not. has_value) then
         ! an option is no value (a file with such a name is ./--name)
         if (i < size(arguments)) has_value = find_option(arguments(i + 1)%text) == 0 .and. &
             arguments(i + 1)%text /= '--'
         if (.not. has_value) then
            call add_problem(self%problems, 'option '//name//' needs a value')
            return
         end if
         i = i + 1
         value = arguments(i)%text
      end if
      call self%set_option(name, value)
   end subroutine read_option

   !> Read an argument that is no option: the command, then files.
   subroutine read_word(self, word, is_file)
      class(parser_type), intent(inout) :: self
      character(len=*), intent(in) :: word
      logical, intent(in) :: is_file          !! even when it is the first
      if (len(self%line%command) == 0 .and. .not. is_file) then
         if (any(command_names == word)) then
            self%line%command = word
         else if (word == 'help') then
            self%line%help = .true.
         else if (self%line%help .and. word == 'completion') then
            self%line%topic = word
         else if (self%line%completion == unknown_shell) then
            call self%set_option('--completion', word)
         else if (word == 'completion') then
            self%line%completion = unknown_shell
         else if (self%line%help .and. len(word) > 0) then
            self%line%topic = word
         else if (len(word) == 0) then
            call add_problem(self%problems, 'a command is needed, found an empty word')
         else
            call add_problem(self%problems, "unknown command '"//word//"'"//did_you_mean(word, command_names))
            self%line%command = '?'
         end if
         return
      end if
      call add_argument(word, self%line%files)
      if (len(word) == 0) call add_problem(self%problems, 'a file name is empty')
   end subroutine read_word

   !> Store the value of an option.
   subroutine set_option(self, name, value)
      class(parser_type), intent(inout) :: self
      character(len=*), intent(in) :: name, value
      associate (line => self%line)
         select case (name)
         case ('--help'); line%help = .true.
         case ('--version'); line%version = .true.
         case ('--strict'); line%strict = .true.
         case ('--allow-open'); line%allow_open = .true.
         case ('--force'); line%force = .true.
         case ('--quiet'); line%quiet = .true.
         case ('--json'); line%json = .true.
         case ('--options-table'); line%options_table = .true.
         case ('--as-namelist'); line%as_namelist = .true.
         case ('--list'); line%list = .true.
         case ('--watch'); line%watch = .true.
         case ('--output'); call get_path(name, value, line%output, self%problems)
         case ('--config'); call get_path(name, value, line%config, self%problems)
         case ('--solver'); line%solver = value
         case ('--completion')
            line%completion = value
            if (all(shells /= value)) call add_problem(self%problems, "completion: '"//value// &
                                                       "' is none of bash, zsh, fish"//did_you_mean(value, shells))
         case ('--search'); call get_search(value, line%search, self%problems)
         case ('--joints'); call get_name(name, value, line%search%joints, self%problems)
         case ('--loads'); call get_name(name, value, line%search%loads, self%problems)
         case ('--factors'); call get_name(name, value, line%search%factors, self%problems)
         case ('--stage'); call get_name(name, value, line%search%stage, self%problems)
         case ('--from'); call get_number(name, value, line%search%from, self%problems, .false.)
         case ('--to'); call get_number(name, value, line%search%to, self%problems, .false.)
         case ('--tolerance'); call get_number(name, value, line%search%tolerance, self%problems, .true.)
         case ('--jobs'); call get_whole(name, value, 1, most_threads, line%search%jobs, self%problems)
         case ('--max-steps'); call get_whole(name, value, 2, huge(1), line%search%max_steps, self%problems)
         case ('--dialect')
            select case (value)
            case (dda_windows, old_dda_windows); line%dialect = dialect%windows
            case ('g0'); line%dialect = dialect%g0
            case default
               call add_problem(self%problems, "option --dialect: '"//value//"' is neither "//dda_windows//' nor g0')
            end select
         case ('--seed'); call get_whole(name, value, 0, largest_seed, line%seed, self%problems)
         case ('--threads'); call get_whole(name, value, 1, most_threads, line%threads, self%problems)
         case ('--steps'); call get_whole(name, value, 0, huge(1), line%steps, self%problems)
         case ('--save-every'); call get_whole(name, value, 1, huge(1), line%save_every, self%problems)
         case ('--t-end'); call get_number(name, value, line%t_end, self%problems, .true.)
         case ('--max-wall'); call get_number(name, value, line%max_wall, self%problems, .true.)
         case ('--checkpoint-every'); call get_number(name, value, line%checkpoint_every, self%problems, .true.)
         end select
      end associate
   end subroutine set_option

   !> Get the path from the value of an option.
   pure subroutine get_path(name, value, path, problems)
      character(len=*), intent(in) :: name, value
      character(len=:), allocatable, intent(inout) :: path
      character(len=:), allocatable, intent(inout) :: problems
      path = value
      if (len_trim(value) == 0) call add_problem(problems, 'option '//name//': expected a file name, found nothing')
   end subroutine get_path

   !> Get a whole number between two bounds from the value of an option; unchanged when there is a problem.
   pure subroutine get_whole(name, value, least, most, number, problems)
      character(len=*), intent(in) :: name, value
      integer, intent(in) :: least, most
      integer, intent(inout) :: number
      character(len=:), allocatable, intent(inout) :: problems
      real(wp) :: x
      integer :: status
      call parse_number(value, x, status)
      if (status == number_status%ok .and. x > most) then
         call add_problem(problems, 'option '//name//': must be '//to_string(most)//' or less, found '//value)
      else if (status /= number_status%ok .or. .not. is_whole(x)) then
         call add_problem(problems, 'option '//name//": expected a whole number, found '"//value//"'")
      else if (nint(x) < least) then
         call add_problem(problems, 'option '//name//': must be '//to_string(least)//' or more, found '//value)
      else
         number = nint(x)
      end if
   end subroutine get_whole

   !> Get a number from the value of an option; unchanged when there is a problem.
   pure subroutine get_number(name, value, number, problems, is_positive)
      character(len=*), intent(in) :: name, value
      logical, intent(in) :: is_positive      !! it must be above 0
      real(wp), intent(inout) :: number
      character(len=:), allocatable, intent(inout) :: problems
      real(wp) :: x
      integer :: status
      call parse_number(value, x, status)
      if (status /= number_status%ok) then
         call add_problem(problems, 'option '//name//": expected a number, found '"//value//"'")
      else if (is_positive .and. .not. x > 0) then
         call add_problem(problems, 'option '//name//': must be above 0, found '//value)
      else
         number = x
      end if
   end subroutine get_number

   !> Get a name from the value of an option.
   pure subroutine get_name(name, value, text, problems)
      character(len=*), intent(in) :: name, value
      character(len=:), allocatable, intent(inout) :: text
      character(len=:), allocatable, intent(inout) :: problems
      text = trim(adjustl(value))
      if (len(text) == 0) call add_problem(problems, 'option '//name//': expected a name, found nothing')
   end subroutine get_name

   !> Get the kind of a search from the value of an option.
   pure subroutine get_search(value, search, problems)
      character(len=*), intent(in) :: value
      type(search_options_type), intent(inout) :: search
      character(len=:), allocatable, intent(inout) :: problems
      integer :: i
      do i = 1, size(search_names)
         if (search_names(i) == value) then
            search%kind = i
            return
         end if
      end do
      call add_problem(problems, "option --search: '"//value//"' is none of strength, tilt, push, gravity, load"// &
                       did_you_mean(value, search_names))
   end subroutine get_search

   !> Add a problem for each option that does not belong to the command.
   subroutine check_options(self)
      class(parser_type), intent(inout) :: self
      integer :: k
      if (self%line%completion == unknown_shell .and. .not. self%line%help) call add_problem( &
         self%problems, "'rockdda completion' needs a shell: bash, zsh or fish")
      if (self%line%help .and. self%line%completion == unknown_shell) self%line%topic = 'completion'
      if (len(self%line%command) == 0) return
      do k = 1, size(options)
         if (.not. self%is_given(k) .or. is_option_of(k, self%line%command)) cycle
         call add_problem(self%problems, "option "//trim(options(k)%name)//" does not belong to 'rockdda "// &
                          self%line%command//"'")
      end do
   end subroutine check_options

   !> Add a problem on a line of its own.
   pure subroutine add_problem(problems, text)
      character(len=:), allocatable, intent(inout) :: problems
      character(len=*), intent(in) :: text
      if (len(problems) > 0) problems = problems//new_line('a')
      problems = problems//text
   end subroutine add_problem

end module rockdda_app_arguments
