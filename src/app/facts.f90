! SPDX-License-Identifier: MIT
!> Named facts about a file, to be printed as text or as JSON.
module rockdda_app_facts
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : replaced, to_string
   use rockdda_model_units, only : unit_system_type
   use rockdda_app_json, only : json_type
   implicit none
   private
   public :: facts_type, json_type

   integer, parameter :: most_motions = 20      !! that the text shows; JSON has all

   type :: facts_type
      character(len=:), allocatable :: title       !! the file
      integer :: n = 0                           !! lines
      type(unit_system_type) :: system           !! units in which the text shows reals; JSON has the numbers
      character(len=:), allocatable, private :: lines   !! one a fact, each after a line end
      type(json_type), private :: members
      integer, private :: n_motions = 0
   contains
      generic :: add => add_text, add_integer, add_real, add_logical
      procedure :: add_motion
      procedure :: to_text => facts_to_text
      procedure :: to_json => facts_to_json
      procedure, private :: add_text, add_integer, add_real, add_logical, show
   end type facts_type

contains

   !> Append a line of the text.
   subroutine show(self, name, value)
      class(facts_type), intent(inout) :: self
      character(len=*), intent(in) :: name, value
      character(len=24) :: shown
      shown = replaced(name, '_', ' ')
      if (.not. allocated(self%lines)) self%lines = ''
      self%lines = self%lines//new_line('a')//'  '//shown//value
      self%n = self%n + 1
   end subroutine show

   !> Add a text.
   subroutine add_text(self, name, value)
      class(facts_type), intent(inout) :: self
      character(len=*), intent(in) :: name, value
      call self%members%put(name, value)
      call self%show(name, value)
   end subroutine add_text

   !> Add a whole number.
   subroutine add_integer(self, name, value)
      class(facts_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: value
      call self%members%put(name, value)
      call self%show(name, to_string(value))
   end subroutine add_integer

   !> Add a real.
   subroutine add_real(self, name, value, dimension)
      class(facts_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: value
      character(len=*), intent(in), optional :: dimension    !! as options have it, 'stress/length'; a pure number
      call self%members%put(name, value)
      if (present(dimension)) then
         call self%show(name, self%system%shown(value, dimension, 10))
      else
         call self%show(name, self%system%shown(value, '', 10))
      end if
   end subroutine add_real

   !> Add yes or no.
   subroutine add_logical(self, name, value)
      class(facts_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(in) :: value
      call self%members%put(name, value)
      call self%show(name, trim(merge('yes', 'no ', value)))
   end subroutine add_logical

   !> Add the displacement of a point in a stage and since the start.
   subroutine add_motion(self, name, stage, change, total)
      class(facts_type), intent(inout) :: self
      character(len=*), intent(in) :: name, stage
      real(wp), intent(in) :: change(2), total(2)
      call self%members%open('{', name)
      call self%members%put('stage', stage)
      call self%members%put('change', change)
      call self%members%put('since_start', total)
      call self%members%close('}')
      self%n_motions = self%n_motions + 1
      if (self%n_motions <= most_motions) &
         call self%show(name, "'"//stage//"': "//pair(change)//'; since the start '//pair(total))

   contains

      !> A displacement as text.
      pure function pair(d) result(shown)
         real(wp), intent(in) :: d(2)
         character(len=:), allocatable :: shown
         shown = '('//self%system%shown(d(1), 'length', 4)//', '//self%system%shown(d(2), 'length', 4)//')'
      end function pair

   end subroutine add_motion

   !> The file, then one fact a line.
   function facts_to_text(self) result(text)
      class(facts_type), intent(in) :: self
      character(len=:), allocatable :: text
      character(len=24) :: name
      text = self%title
      if (allocated(self%lines)) text = text//self%lines
      name = 'displacements left out'
      if (self%n_motions > most_motions) text = text//new_line('a')//'  '//name// &
                                                to_string(self%n_motions - most_motions)//' more; --json has all'
   end function facts_to_text

   !> Write an object with the member `file` and the facts.
   subroutine facts_to_json(self, json, name)
      class(facts_type), intent(in) :: self
      type(json_type), intent(inout) :: json
      character(len=*), intent(in) :: name  !! of the object in another one; '' in an array
      call json%open('{', name)
      call json%put('file', self%title)
      call json%append(self%members)
      call json%close('}')
   end subroutine facts_to_json

end module rockdda_app_facts
