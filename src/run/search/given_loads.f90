! SPDX-License-Identifier: MIT
!> Loads that have a name, as the model gives them: a search multiplies them.
module rockdda_run_given_loads
   use rockdda_base_kinds, only : wp
   use rockdda_base_error, only : error_type, error_code, make_error
   use rockdda_model_analysis_input, only : time_table_type
   use rockdda_model_options, only : boundary_type, line_load_type, is_set
   use rockdda_model_parameters, only : parameters_type
   use rockdda_model_regions, only : count_words, same_name, word_of
   use rockdda_base_suggest, only : did_you_mean
   use rockdda_interaction_time_tables, only : load_factor
   implicit none
   private
   public :: given_loads_type, name_length, loads_of, choose_loads, multiply_loads, end_tables

   integer, parameter :: name_length = 80

   type :: given_loads_type
      type(time_table_type), allocatable :: points(:)
      type(line_load_type), allocatable :: lines(:)
      type(boundary_type), allocatable :: boundaries(:)
   contains
      procedure :: names
   end type given_loads_type

contains

   !> The loads of a model.
   pure function loads_of(parameters) result(loads)
      type(parameters_type), intent(in) :: parameters
      type(given_loads_type) :: loads
      loads%points = parameters%loading_tables
      loads%lines = parameters%line_loads
      allocate (loads%boundaries(0))
      if (allocated(parameters%boundaries)) loads%boundaries = parameters%boundaries
   end function loads_of

   !> Their names, each once.
   pure function names(self)
      class(given_loads_type), intent(in) :: self
      character(len=name_length), allocatable :: names(:)
      integer :: i
      allocate (names(0))
      do i = 1, size(self%points)
         call add(self%points(i)%name)
      end do
      do i = 1, size(self%lines)
         call add(self%lines(i)%name)
      end do
      do i = 1, size(self%boundaries)
         if (self%boundaries(i)%kind == 'traction') call add(self%boundaries(i)%name)
      end do

   contains

      !> Add a name.
      pure subroutine add(name)
         character(len=:), allocatable, intent(in) :: name
         integer :: k
         if (.not. allocated(name)) return
         if (len_trim(name) == 0) return
         do k = 1, size(names)
            if (same_name(names(k), name)) return
         end do
         names = [names, [character(len=name_length) :: name]]
      end subroutine add

   end function names

   !> The loads that a list names; all that have a name when it is empty. Errors: there are none, unknown names.
   subroutine choose_loads(loads, list, option, chosen, error)
      type(given_loads_type), intent(in) :: loads
      character(len=*), intent(in) :: list                  !! commas between the names
      character(len=*), intent(in) :: option                !! of the command line
      character(len=name_length), allocatable, intent(out) :: chosen(:)
      type(error_type), allocatable, intent(out) :: error
      character(len=name_length), allocatable :: known(:)
      character(len=:), allocatable :: word, text
      integer :: i, k
      known = loads%names()
      if (size(known) == 0) then
         call make_error(error, error_code%input, 'option '//option//': no load of the model has a name; give one '// &
                         "to &loading_point, &line_load or &boundary kind = 'traction' (name = 'traffic')")
         return
      end if
      chosen = known
      if (len_trim(list) == 0) return
      chosen = known(1:0)
      do k = 1, count_words(list)
         word = word_of(list, k)
         do i = 1, size(known)
            if (same_name(known(i), word)) exit
         end do
         if (i <= size(known)) then
            chosen = [chosen, known(i)]
            cycle
         end if
         text = "option "//option//": there is no load '"//word//"'"//did_you_mean(word, known)//'; the loads are '
         do i = 1, size(known)
            if (i > 1) text = text//', '
            text = text//trim(known(i))
         end do
         call make_error(error, error_code%input, text)
         return
      end do
   end subroutine choose_loads

   !> Loads of these names times a factor; the others as they are.
   pure subroutine multiply_loads(loads, names, factor, parameters)
      type(given_loads_type), intent(in) :: loads
      character(len=*), intent(in) :: names(:)
      real(wp), intent(in) :: factor
      type(parameters_type), intent(inout) :: parameters
      integer :: i
      do i = 1, size(loads%points)
         if (.not. is_one(loads%points(i)%name, names) .or. .not. allocated(loads%points(i)%rows)) cycle
         parameters%loading_tables(i)%rows(2:3, :) = factor*loads%points(i)%rows(2:3, :)
      end do
      do i = 1, size(loads%lines)
         if (.not. is_one(loads%lines(i)%name, names)) cycle
         call scale_line(loads%lines(i), factor, parameters%line_loads(i))
      end do
      do i = 1, size(loads%boundaries)
         if (.not. is_one(loads%boundaries(i)%name, names)) cycle
         call scale_boundary(loads%boundaries(i), factor, parameters%boundaries(i))
      end do
   end subroutine multiply_loads

   !> Loads of these names are constant, as at the end of their tables.
   pure subroutine end_tables(names, parameters)
      character(len=*), intent(in) :: names(:)
      type(parameters_type), intent(inout) :: parameters
      type(line_load_type) :: line
      type(boundary_type) :: boundary
      integer :: i, n
      do i = 1, size(parameters%loading_tables)
         associate (table => parameters%loading_tables(i))
            if (.not. is_one(table%name, names) .or. .not. allocated(table%rows)) cycle
            n = size(table%rows, 2)
            if (n > 1) table%rows = reshape(table%rows(:, n), [3, 1])
         end associate
      end do
      do i = 1, size(parameters%line_loads)
         associate (load => parameters%line_loads(i))
            if (.not. is_one(load%name, names) .or. .not. allocated(load%table)) cycle
            line = load
            call scale_line(line, load_factor(load%table, huge(1.0_wp)), load)
            deallocate (load%table)
         end associate
      end do
      if (.not. allocated(parameters%boundaries)) return
      do i = 1, size(parameters%boundaries)
         associate (load => parameters%boundaries(i))
            if (.not. is_one(load%name, names) .or. .not. allocated(load%table)) cycle
            boundary = load
            call scale_boundary(boundary, load_factor(load%table, huge(1.0_wp)), load)
            deallocate (load%table)
         end associate
      end do
   end subroutine end_tables

   !> The forces of a line load times a factor.
   pure subroutine scale_line(given, factor, used)
      type(line_load_type), intent(in) :: given
      real(wp), intent(in) :: factor
      type(line_load_type), intent(inout) :: used
      used%force_start = factor*given%force_start
      used%force_end = factor*given%force_end
   end subroutine scale_line

   !> The stress, traction or pressure of a boundary times a factor.
   pure subroutine scale_boundary(given, factor, used)
      type(boundary_type), intent(in) :: given
      real(wp), intent(in) :: factor
      type(boundary_type), intent(inout) :: used
      if (allocated(given%stress)) used%stress = factor*given%stress
      if (allocated(given%traction)) used%traction = factor*given%traction
      if (is_set(given%pressure)) used%pressure = factor*given%pressure
   end subroutine scale_boundary

   !> Is a name one of these?
   pure logical function is_one(name, names)
      character(len=:), allocatable, intent(in) :: name
      character(len=*), intent(in) :: names(:)
      integer :: k
      is_one = .false.
      if (.not. allocated(name)) return
      do k = 1, size(names)
         is_one = is_one .or. same_name(name, names(k))
      end do
   end function is_one

end module rockdda_run_given_loads
