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

   integer, parameter :: is_text = 1, is_integer = 2, is_real = 3, is_logical = 4, is_motion = 5
   integer, parameter :: most_motions = 20      !! that the text shows; JSON has all

   type :: fact_type
      character(len=:), allocatable :: name
      integer :: type = 0
      character(len=:), allocatable :: text      !! or the dimension of a real
      integer :: whole = 0
      real(wp) :: number = 0
      logical :: flag = .false.
      real(wp) :: motion(4) = 0                 !! in a stage, and since the start
   end type fact_type

   type :: facts_type
      character(len=:), allocatable :: title       !! the file
      integer :: n = 0
      type(unit_system_type) :: system           !! units in which the text shows reals; JSON has the numbers
      type(fact_type), allocatable, private :: items(:)
   contains
      generic :: add => add_text, add_integer, add_real, add_logical
      procedure :: add_motion
      procedure :: to_text => facts_to_text
      procedure :: to_json => facts_to_json
      procedure, private :: add_text, add_integer, add_real, add_logical, next
   end type facts_type

contains

   !> Append a fact of a name.
   subroutine next(self, name, type)
      class(facts_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: type
      type(fact_type), allocatable :: larger(:)
      if (.not. allocated(self%items)) allocate (self%items(32))
      if (self%n == size(self%items)) then
         allocate (larger(2*self%n))
         larger(1:self%n) = self%items
         call move_alloc(larger, self%items)
      end if
      self%n = self%n + 1
      self%items(self%n)%name = name
      self%items(self%n)%type = type
   end subroutine next

   !> Add a text.
   subroutine add_text(self, name, value)
      class(facts_type), intent(inout) :: self
      character(len=*), intent(in) :: name, value
      call self%next(name, is_text)
      self%items(self%n)%text = value
   end subroutine add_text

   !> Add a whole number.
   subroutine add_integer(self, name, value)
      class(facts_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: value
      call self%next(name, is_integer)
      self%items(self%n)%whole = value
   end subroutine add_integer

   !> Add a real.
   subroutine add_real(self, name, value, dimension)
      class(facts_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: value
      character(len=*), intent(in), optional :: dimension    !! as options have it, 'stress/length'; a pure number
      call self%next(name, is_real)
      self%items(self%n)%text = ''
      if (present(dimension)) self%items(self%n)%text = dimension
      self%items(self%n)%number = value
   end subroutine add_real

   !> Add the displacement of a point in a stage and since the start.
   subroutine add_motion(self, name, stage, change, total)
      class(facts_type), intent(inout) :: self
      character(len=*), intent(in) :: name, stage
      real(wp), intent(in) :: change(2), total(2)
      call self%next(name, is_motion)
      self%items(self%n)%text = stage
      self%items(self%n)%motion = [change, total]
   end subroutine add_motion

   !> Add yes or no.
   subroutine add_logical(self, name, value)
      class(facts_type), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(in) :: value
      call self%next(name, is_logical)
      self%items(self%n)%flag = value
   end subroutine add_logical

   !> The file, then one fact a line.
   function facts_to_text(self) result(text)
      class(facts_type), intent(in) :: self
      character(len=:), allocatable :: text
      character(len=24) :: name
      integer :: i, n_motions
      text = self%title
      n_motions = 0
      do i = 1, self%n
         if (self%items(i)%type == is_motion) then
            n_motions = n_motions + 1
            if (n_motions > most_motions) cycle
         end if
         name = replaced(self%items(i)%name, '_', ' ')
         text = text//new_line('a')//'  '//name
         select case (self%items(i)%type)
         case (is_text); text = text//self%items(i)%text
         case (is_integer); text = text//to_string(self%items(i)%whole)
         case (is_real); text = text//self%system%shown(self%items(i)%number, self%items(i)%text, 10)
         case (is_motion)
            text = text//"'"//self%items(i)%text//"': "//pair(self%items(i)%motion(1:2))//'; since the start '// &
                   pair(self%items(i)%motion(3:4))
         case default; text = text//trim(merge('yes', 'no ', self%items(i)%flag))
         end select
      end do
      name = 'displacements left out'
      if (n_motions > most_motions) text = text//new_line('a')//'  '//name//to_string(n_motions - most_motions)// &
                                           ' more; --json has all'

   contains

      !> A displacement as text.
      pure function pair(d) result(shown)
         real(wp), intent(in) :: d(2)
         character(len=:), allocatable :: shown
         shown = '('//self%system%shown(d(1), 'length', 4)//', '//self%system%shown(d(2), 'length', 4)//')'
      end function pair

   end function facts_to_text

   !> Write an object with the member `file` and the facts.
   subroutine facts_to_json(self, json, name)
      class(facts_type), intent(in) :: self
      type(json_type), intent(inout) :: json
      character(len=*), intent(in) :: name  !! of the object in another one; '' in an array
      integer :: i
      call json%open('{', name)
      call json%put('file', self%title)
      do i = 1, self%n
         associate (item => self%items(i))
            select case (item%type)
            case (is_text); call json%put(item%name, item%text)
            case (is_integer); call json%put(item%name, item%whole)
            case (is_real); call json%put(item%name, item%number)
            case (is_motion)
               call json%open('{', item%name)
               call json%put('stage', item%text)
               call json%put('change', item%motion(1:2))
               call json%put('since_start', item%motion(3:4))
               call json%close('}')
            case default; call json%put(item%name, item%flag)
            end select
         end associate
      end do
      call json%close('}')
   end subroutine facts_to_json

end module rockdda_app_facts
